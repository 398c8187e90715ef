#!/usr/bin/env python3
"""armesh-check from outside: exit codes, messages, JSON, CSV, PLY, files that appear whole. Needs no packages.

    test_armesh_check.py PROGRAM PART
"""
import csv
import json
import math
import os
import pathlib
import pty
import re
import signal
import stat
import struct
import subprocess
import sys
import tempfile
import time
import unittest

PROGRAM, PART = sys.argv[1], sys.argv[2]


def run(*args, **kwargs):
    return subprocess.run([PROGRAM, *map(str, args)], capture_output=True, text=True, timeout=300, **kwargs)


def box(x, y, z, n=6):
    """Binary STL of a closed box whose sides are n x n cells."""
    triangles = []
    size = (x, y, z)
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for side in (0, 1):
            for i in range(n):
                for k in range(n):
                    def corner(a, b):
                        p = [0.0, 0.0, 0.0]
                        p[axis], p[u], p[v] = side * size[axis], size[u] * (i + a) / n, size[v] * (k + b) / n
                        return p
                    q = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)]
                    if side == 0:
                        q.reverse()
                    triangles += [(q[0], q[1], q[2]), (q[0], q[2], q[3])]
    out = bytes(80) + struct.pack('<I', len(triangles))
    for t in triangles:
        out += struct.pack('<12f', 0, 0, 0, *sum(t, [])) + b'\0\0'
    return out


SCHEMA = json.loads((pathlib.Path(__file__).resolve().parent.parent / 'docs' / 'report-schema.json').read_text())
TYPES = {'object': dict, 'array': list, 'string': str, 'number': (int, float), 'integer': int, 'null': type(None)}


def faults(value, schema, at='$'):
    """What a JSON value has against a JSON schema; of the keywords those that the report's schema uses."""
    out = []
    for key, rule in schema.items():
        if key == '$ref':
            out += faults(value, SCHEMA['$defs'][rule.rsplit('/', 1)[1]], at)
        elif key == 'type':
            types = [rule] if isinstance(rule, str) else rule
            if isinstance(value, bool) or not any(isinstance(value, TYPES[t]) for t in types):
                out.append(f'{at}: not {rule}')
        elif key == 'const':
            out += [] if value == rule else [f'{at}: not {rule}']
        elif key == 'enum':
            out += [] if value in rule else [f'{at}: none of {rule}']
        elif key == 'minimum':
            out += [f'{at}: below {rule}'] if isinstance(value, (int, float)) and value < rule else []
        elif key == 'items' and isinstance(value, list):
            out += [f for i, v in enumerate(value) for f in faults(v, rule, f'{at}[{i}]')]
        elif key in ('minItems', 'maxItems') and isinstance(value, list):
            out += [f'{at}: {len(value)} items'] if (len(value) < rule if key == 'minItems' else len(value) > rule) else []
        elif key == 'uniqueItems':
            out += [] if len(set(value)) == len(value) else [f'{at}: repeats']
        elif key == 'required' and isinstance(value, dict):
            out += [f'{at}: no {k}' for k in rule if k not in value]
        elif key == 'properties' and isinstance(value, dict):
            out += [f for k, r in rule.items() if k in value for f in faults(value[k], r, f'{at}.{k}')]
        elif key == 'additionalProperties' and isinstance(value, dict):
            out += [f'{at}: {k} is not known' for k in value if k not in schema['properties']]
        elif key not in ('$schema', '$defs', 'title', 'description', 'items', 'minItems', 'maxItems', 'required',
                         'properties', 'additionalProperties'):
            raise ValueError(f'the validator does not know {key}')
    return out


class Check(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.dir = pathlib.Path(self.folder.name)

    def tearDown(self):
        self.folder.cleanup()

    def refused(self, *args, says=''):
        before = sorted(self.dir.iterdir())
        p = run(*args)
        self.assertEqual(p.returncode, 2, p)
        self.assertEqual(p.stdout, '')
        self.assertRegex(p.stderr, r'\Aarmesh-check: .+\n\Z')  # one line
        self.assertIn(says, p.stderr)
        self.assertEqual(sorted(self.dir.iterdir()), before)  # nothing left behind

    def test_slender_part(self):
        p = run(PART)
        self.assertEqual(p.returncode, 1, p.stderr)
        self.assertEqual(p.stderr, '')
        for words in ('Mesh', 'closed', 'D1', 'D2', 'Worst places', 'TOO SLENDER'):
            self.assertIn(words, p.stdout)

    def test_stout_part(self):
        part = self.dir / 'cube.stl'
        part.write_bytes(box(10, 10, 10))
        p = run(part)
        self.assertEqual(p.returncode, 0, p)
        self.assertIn('ok', p.stdout)

    def test_limit_is_inclusive(self):
        out = self.dir / 'r.json'
        run(PART, '--json', out)
        report = json.loads(out.read_text())
        ratio = max([report['summary']['ratio_max']] + [f['ratio'] for f in report['features']])
        self.assertEqual(run(PART, '--quiet', '--limit', repr(ratio)).returncode, 1)
        self.assertEqual(run(PART, '--quiet', '--limit', repr(math.nextafter(ratio, math.inf))).returncode, 0)

    def test_features(self):
        out, ply = self.dir / 'r.json', self.dir / 'f.ply'
        p = run(PART, '--json', out, '--feature-ply', ply)
        report = json.loads(out.read_text())
        features, of_face = report['features'], report['face_feature']
        self.assertEqual(faults(report, SCHEMA), [])
        self.assertNotEqual(faults({**report, 'features': [{**features[0], 'kind': 'thing'}]}, SCHEMA), [])
        self.assertNotEqual(faults({**report, 'features': [{**features[0], 'more': 1}]}, SCHEMA), [])
        self.assertEqual(len(of_face), report['mesh']['faces'])
        self.assertEqual(sorted(f['id'] for f in features), list(range(len(features))))
        self.assertEqual(set(of_face), set(range(len(features))))
        order = [('error', 'warning', 'ok').index(f['severity']) for f in features]
        self.assertEqual(order, sorted(order))
        for f in features:
            self.assertAlmostEqual(f['ratio'], f['d1_max'] / f['d2_max'], 9)
            self.assertEqual(f['severity'], 'error' if f['ratio'] >= 8 else 'warning' if f['ratio'] >= 5 else 'ok')
            self.assertEqual(of_face.count(f['id']), f['faces'])
        self.assertIn('Features: %d' % len(features), p.stdout)
        self.assertTrue(ply.read_bytes().startswith(b'ply'))

    def test_least_width_is_inclusive(self):
        part, out = self.dir / 'cube.stl', self.dir / 'r.json'
        part.write_bytes(box(10, 10, 10))
        run(part, '--json', out)
        (cube,) = json.loads(out.read_text())['features']
        least = cube['d2_min']
        self.assertEqual(run(part, '--quiet', '--min-width', repr(least)).returncode, 1)
        self.assertEqual(run(part, '--quiet', '--min-width', repr(math.nextafter(least, 0))).returncode, 0)

    def test_quiet_says_nothing(self):
        p = run(PART, '--quiet')
        self.assertEqual((p.returncode, p.stdout, p.stderr), (1, '', ''))

    def test_help_and_version(self):
        p = run('--help')
        self.assertEqual(p.returncode, 0)
        for option in ('--json', '--vertex-csv', '--ply', '--threads', '--rays', '--cone', '--limit', '--profile', '--quiet'):
            self.assertIn(option, p.stdout)
        self.assertRegex(run('--version').stdout, r'\Aarmesh-check \d+\.\d+\.\d+\n\Z')

    def test_wrong_usage(self):
        self.refused()
        self.refused(PART, PART, says='one part')
        self.refused(PART, '--frobnicate', says='--frobnicate')
        self.refused(PART, '--json', says='--json')
        self.refused(PART, '--limit', 'eight', says='eight')
        self.refused(PART, '--limit', 'nan')
        self.refused(PART, '--limit', '-1')
        self.refused(PART, '--limit', '8x')
        self.refused(PART, '--rays', '2.5')
        self.refused(PART, '--rays', '0')
        self.refused(PART, '--profile', 'pretty')
        self.refused(PART, '--cone', '180')
        self.refused(PART, '--threads', '-1')
        self.refused(PART, '--json', self.dir / 'a', '--ply', self.dir / 'a', says='twice')
        self.refused(PART, '--ply', PART, says='twice')

    def test_bad_parts(self):
        (self.dir / 'empty.stl').write_bytes(b'')
        (self.dir / 'text.stl').write_text('not a mesh')
        (self.dir / 'short.stl').write_bytes(box(1, 1, 1)[:500])
        self.refused(self.dir / 'missing.stl', says='missing.stl')
        self.refused(self.dir, says=str(self.dir))
        for name in ('empty.stl', 'text.stl', 'short.stl'):
            self.refused(self.dir / name, '--json', self.dir / 'out.json', says=name)

    def test_unwritable_outputs_are_known_before_the_work(self):
        for option in ('--json', '--vertex-csv', '--ply'):
            self.refused(PART, option, self.dir / 'no' / 'such' / 'folder', says='no/such/folder')
            self.refused(PART, option, self.dir, says='folder')

    def test_json(self):
        out = self.dir / 'r.json'
        self.assertEqual(run(PART, '--json', out).returncode, 1)
        r = json.loads(out.read_text())
        s = r['summary']
        self.assertEqual(r['schema'], 'armesh-check/1')
        self.assertEqual(r['file'], PART)
        self.assertEqual(s['ratio_max'], s['d1_max'] / s['d2_max'])
        self.assertAlmostEqual(s['ratio_mean'], s['d1_mean'] / s['d2_mean'])
        self.assertIs(r['over_limit'], True)
        self.assertEqual(r['limit'], 8)
        self.assertEqual(r['options'], {'profile': 'print', 'rays': 20, 'cone_degrees': 120})
        self.assertIs(r['mesh']['closed'], True)
        self.assertEqual(r['mesh']['bounding_box'], [[0, 0, 0], [60, 36, 33]])
        self.assertTrue(all(f['count'] == 0 for f in r['mesh']['findings'].values()), r['mesh']['findings'])
        ratios = [p['ratio'] for p in r['worst']]
        self.assertEqual(ratios, sorted(ratios, reverse=True))
        self.assertTrue(1 <= len(ratios) <= 5)
        self.assertEqual(ratios[0], s['vertex_ratio_max'])
        diagonal = math.dist(*r['mesh']['bounding_box'])
        places = [p['at'] for p in r['worst']]
        for i, p in enumerate(places):
            for q in places[:i]:
                self.assertGreaterEqual(math.dist(p, q), 0.1 * diagonal)

    def test_options_reach_the_library(self):
        out = self.dir / 'r.json'
        run(PART, '--json', out, '--profile', 'paper', '--rays=7', '--cone', '60.5')
        narrow = json.loads(out.read_text())
        self.assertEqual(narrow['options'], {'profile': 'paper', 'rays': 7, 'cone_degrees': 60.5})
        run(PART, '--json', out, '--profile=paper')
        self.assertNotEqual(narrow['summary']['d2_mean'], json.loads(out.read_text())['summary']['d2_mean'])

    def test_json_escapes_the_file_name(self):
        name = 'quo"te \\ tab\t \u00fcml\u00e4ut.stl'
        part = self.dir / name
        part.write_bytes(box(4, 4, 4))
        self.assertEqual(run(part, '--json', self.dir / 'r.json').returncode, 0)
        self.assertEqual(json.loads((self.dir / 'r.json').read_text())['file'], str(part))
        broken = os.fsencode(self.dir) + b'/\xff\xfe.stl'  # not UTF-8
        with open(broken, 'wb') as f:
            f.write(box(4, 4, 4))
        p = subprocess.run([os.fsencode(PROGRAM), broken, b'--json', os.fsencode(self.dir / 'r.json'), b'--quiet'])
        self.assertEqual(p.returncode, 0)
        self.assertIn('\ufffd', json.loads((self.dir / 'r.json').read_text())['file'])

    def test_csv(self):
        out = self.dir / 'v.csv'
        run(PART, '--vertex-csv', out, '--json', self.dir / 'r.json')
        r = json.loads((self.dir / 'r.json').read_text())
        self.assertTrue(out.read_text().startswith('x,y,z,d1,d2,ratio\n'))
        rows = list(csv.DictReader(out.read_text().splitlines()))
        self.assertEqual(len(rows), r['mesh']['vertices'])
        # the longest way across the part may end inside faces
        longest = max(float(row['d1']) for row in rows)
        self.assertLessEqual(longest, r['summary']['d1_max'])
        self.assertGreater(longest, 0.9 * r['summary']['d1_max'])
        self.assertEqual(max(float(row['d2']) for row in rows), r['summary']['d2_max'])
        for row in rows:
            self.assertEqual(float(row['ratio']), float(row['d1']) / float(row['d2']))
        self.assertEqual(len({(row['x'], row['y'], row['z']) for row in rows}), len(rows))  # welded

    def test_same_output_for_every_thread_count(self):
        texts = set()
        for threads in (1, 2, 5):
            run(PART, '--threads', threads, '--vertex-csv', self.dir / 'v.csv')
            texts.add((self.dir / 'v.csv').read_bytes())
        self.assertEqual(len(texts), 1)

    def test_ply(self):
        out = self.dir / 'p.ply'
        run(PART, '--ply', out)
        head = out.read_bytes().split(b'end_header\n')[0].decode()
        self.assertTrue(head.startswith('ply\nformat binary_little_endian 1.0\n'))
        for name in ('red', 'green', 'blue', 'd1', 'd2', 'ratio'):
            self.assertRegex(head, rf'property \w+ {name}\n')
        self.assertEqual(run(out).returncode, 1)  # and it is a part again

    def test_outputs_replace_files_but_not_links_or_devices(self):
        (self.dir / 'old.json').write_text('old')
        (self.dir / 'link.json').symlink_to(self.dir / 'old.json')
        run(PART, '--json', self.dir / 'link.json')
        self.assertTrue((self.dir / 'link.json').is_symlink())
        self.assertEqual(json.loads((self.dir / 'old.json').read_text())['schema'], 'armesh-check/1')
        self.assertEqual(run(PART, '--json', '/dev/null').returncode, 1)
        self.assertTrue(stat.S_ISCHR(os.stat('/dev/null').st_mode))

    def test_damaged_part_is_measured_and_warned_about(self):
        data = box(10, 10, 10)
        n = struct.unpack_from('<I', data, 80)[0] - 1
        part = self.dir / 'hole.stl'
        part.write_bytes(data[:80] + struct.pack('<I', n) + data[84:-50])
        p = run(part, '--json', self.dir / 'r.json')
        self.assertEqual(p.returncode, 0, p)
        self.assertIn('NOT closed', p.stdout)
        self.assertRegex(p.stdout, r'warning: 3 open edges .*face \d+ \(')
        f = json.loads((self.dir / 'r.json').read_text())['mesh']['findings']['boundary_edges']
        self.assertEqual(f['count'], 3)
        self.assertEqual(len(f['at']), 3)

    def test_progress_only_on_a_terminal(self):
        ours, theirs = pty.openpty()
        p = subprocess.Popen([PROGRAM, PART], stdout=subprocess.DEVNULL, stderr=theirs)
        os.close(theirs)
        seen = b''
        while True:
            try:
                chunk = os.read(ours, 4096)
            except OSError:
                break
            if not chunk:
                break
            seen += chunk
        self.assertEqual(p.wait(), 1)
        self.assertRegex(seen, rb'\r\[#*\.*\] +\d+ % +\w+')

    @staticmethod
    def catches(pid, number):
        status = pathlib.Path(f'/proc/{pid}/status').read_text()
        mask = next(line for line in status.splitlines() if line.startswith('SigCgt')).split()[1]
        return int(mask, 16) >> (number - 1) & 1

    def test_ctrl_c(self):
        big = self.dir / 'big.stl'
        big.write_bytes(box(10, 10, 10, 70))
        p = subprocess.Popen([PROGRAM, str(big), '--json', str(self.dir / 'r.json')],
                             stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        while p.poll() is None and not self.catches(p.pid, signal.SIGINT):
            time.sleep(0.01)
        time.sleep(0.15)  # it is reading or measuring by then, and far from done
        start = time.time()
        p.send_signal(signal.SIGINT)
        out, err = p.communicate(timeout=60)
        self.assertLess(time.time() - start, 10)
        self.assertEqual((p.returncode, out, err), (130, '', 'armesh-check: stopped\n'))
        self.assertEqual([f.name for f in self.dir.iterdir()], ['big.stl'])


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1], verbosity=1)
