//! Words, numbers and line numbers of text formats.

use crate::error::Error;

/// How much of a file is looked at to tell text from binary.
const SNIFF: usize = 64 << 10;

/// True if the beginning has no byte that a text would not have. NUL and Ctrl-Z padding at the very end is allowed.
pub(super) fn is_text(bytes: &[u8]) -> bool {
    let bytes = trim_end(bytes);
    let head = &bytes[..bytes.len().min(SNIFF)];
    !head.is_empty() && head.iter().all(|&b| b >= 0x20 || (0x09..=0x0d).contains(&b))
}

/// Without the NULs and Ctrl-Zs that some programs pad text with.
pub(super) fn trim_end(bytes: &[u8]) -> &[u8] {
    let end = bytes.iter().rposition(|&b| b != 0 && b != 0x1a).map_or(0, |i| i + 1);
    &bytes[..end]
}

/// Without a UTF-8 byte order mark.
pub(super) fn skip_bom(bytes: &[u8]) -> usize {
    if bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 }
}

/// The first word that is not in a `#` comment, at most 32 bytes of it.
pub(super) fn first_word(bytes: &[u8]) -> &[u8] {
    let bytes = &bytes[..bytes.len().min(SNIFF)];
    let mut words = Words { bytes, at: skip_bom(bytes) };
    while let Some(word) = words.next() {
        if word.starts_with(b"#") {
            words.skip_line();
            continue;
        }
        return &word[..word.len().min(32)];
    }
    b""
}

/// A reader of words separated by white space.
#[derive(Clone)]
pub(super) struct Words<'a> {
    pub bytes: &'a [u8],
    /// Position behind the last word.
    pub at: usize,
}

impl<'a> Words<'a> {
    /// The next word, on whichever line; `None` at the end.
    #[inline]
    pub fn next(&mut self) -> Option<&'a [u8]> {
        while self.at < self.bytes.len() && is_space(self.bytes[self.at]) {
            self.at += 1;
        }
        self.word()
    }

    /// The next word of this line; `None` at its end or at a `#` comment. A backslash at the end continues a line.
    #[inline]
    pub fn next_in_line(&mut self) -> Option<&'a [u8]> {
        loop {
            let rest = &self.bytes[self.at..];
            match rest.first()? {
                b' ' | b'\t' | 0x0b | 0x0c => self.at += 1,
                b'\\' if rest[1..].starts_with(b"\n") => self.at += 2,
                b'\\' if rest[1..].starts_with(b"\r\n") => self.at += 3,
                b'\n' | b'\r' | b'#' => return None,
                _ => {
                    let word = self.word()?;
                    let continued = word.len() > 1
                        && word.ends_with(b"\\")
                        && matches!(self.bytes.get(self.at), Some(b'\n' | b'\r'));
                    self.at -= continued as usize;
                    return Some(&word[..word.len() - continued as usize]);
                }
            }
        }
    }

    #[inline]
    fn word(&mut self) -> Option<&'a [u8]> {
        let start = self.at;
        while self.at < self.bytes.len() && !is_space(self.bytes[self.at]) {
            self.at += 1;
        }
        (start < self.at).then(|| &self.bytes[start..self.at])
    }

    /// Moves to the end of the line (not behind it).
    #[inline]
    pub fn skip_line(&mut self) {
        let rest = &self.bytes[self.at..];
        self.at += rest.iter().position(|&b| b == b'\n' || b == b'\r').unwrap_or(rest.len());
    }

    /// The 1-based line of the last word. Counted when asked, which is when something is wrong.
    pub fn line(&self) -> usize {
        line_of(self.bytes, self.at)
    }
}

/// The 1-based line of byte `at`; lines end with LF, CR LF or CR.
pub(super) fn line_of(bytes: &[u8], at: usize) -> usize {
    let mut line = 1;
    for (i, &b) in bytes[..at.min(bytes.len())].iter().enumerate() {
        line += (b == b'\n' || (b == b'\r' && bytes.get(i + 1) != Some(&b'\n'))) as usize;
    }
    line
}

#[inline]
fn is_space(b: u8) -> bool {
    b == b' ' || (0x09..=0x0d).contains(&b)
}

/// The f64 nearest to the number that `word` spells. Takes what C, C++ and Fortran programs print: `1.`, `.5`, `+1e-3`,
/// `1D0`, `nan`, `-nan(ind)`, `inf`, `1.#QNAN`.
#[inline]
pub(super) fn number(word: &[u8]) -> Option<f64> {
    match std::str::from_utf8(word).ok()?.parse() {
        Ok(x) => Some(x),
        Err(_) => odd_number(word),
    }
}

#[cold]
fn odd_number(word: &[u8]) -> Option<f64> {
    if word.len() > 64 {
        return None;
    }
    let lower = word.to_ascii_lowercase();
    let (sign, body) = match lower.first()? {
        b'-' => (-1.0, &lower[1..]),
        b'+' => (1.0, &lower[1..]),
        _ => (1.0, &lower[..]),
    };
    if body.starts_with(b"nan(")
        || body.starts_with(b"1.#qnan")
        || body.starts_with(b"1.#snan")
        || body.starts_with(b"1.#ind")
    {
        return Some(f64::NAN);
    }
    if body.starts_with(b"1.#inf") {
        return Some(sign * f64::INFINITY);
    }
    let fortran: Vec<u8> = body.iter().map(|&b| if b == b'd' { b'e' } else { b }).collect();
    if fortran == body || !fortran[0].is_ascii_digit() && fortran[0] != b'.' {
        return None;
    }
    std::str::from_utf8(&fortran).ok()?.parse::<f64>().ok().map(|x| sign * x)
}

/// The error for a word that is no number: says so if it is one with a decimal comma.
#[cold]
pub(super) fn not_a_number(word: Option<&[u8]>, place: impl std::fmt::Display) -> Error {
    let Some(word) = word else {
        return Error::Format(format!("{place}: a number is missing"));
    };
    let comma = word.iter().position(|&b| b == b',');
    let is_locale = comma.is_some_and(|c| {
        word.get(c + 1).is_some_and(u8::is_ascii_digit) && !word.contains(&b'.') && {
            let dotted: Vec<u8> = word.iter().map(|&b| if b == b',' { b'.' } else { b }).collect();
            number(&dotted).is_some()
        }
    });
    Error::Format(if is_locale {
        format!(
            "{place}: {} has a decimal comma: the file was written under a locale; numbers need a point",
            quote(word)
        )
    } else {
        format!("{place}: {} is not a number", quote(word))
    })
}

/// A piece of a file for a message: printable and short.
pub(super) fn quote(bytes: &[u8]) -> String {
    let short = &bytes[..bytes.len().min(40)];
    format!("'{}'{}", short.escape_ascii(), if bytes.len() > short.len() { "..." } else { "" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_every_dialect() {
        for (text, value) in [
            ("1", 1.0),
            ("-1.", -1.0),
            (".5", 0.5),
            ("+2.5E-3", 0.0025),
            ("1D2", 100.0),
            ("-1.5d-1", -0.15),
            ("inf", f64::INFINITY),
            ("-1.#INF", f64::NEG_INFINITY),
            ("0.1", 0.1),
            ("123456789.123456789", 123_456_789.123_456_79),
            ("4.9e-324", 5e-324),
        ] {
            assert_eq!(number(text.as_bytes()), Some(value), "{text}");
        }
        for text in ["nan", "NaN", "-nan", "-nan(ind)", "1.#QNAN", "-1.#IND"] {
            assert!(number(text.as_bytes()).unwrap().is_nan(), "{text}");
        }
        for text in ["", "-", "1,5", "abc", "1.0.0", "d5", "--1", "0x10", "1e", "-+1d0", "\u{661}"] {
            assert_eq!(number(text.as_bytes()), None, "{text}");
        }
    }

    #[test]
    fn lines_are_counted_for_every_line_ending() {
        for text in ["a\nb\nc", "a\r\nb\r\nc", "a\rb\rc"] {
            let mut words = Words { bytes: text.as_bytes(), at: 0 };
            let lines: Vec<usize> = std::iter::from_fn(|| words.next().map(|_| ()).map(|()| words.line())).collect();
            assert_eq!(lines, [1, 2, 3], "{text:?}");
        }
    }

    #[test]
    fn a_backslash_continues_a_line() {
        for text in ["f 1 2\\\r\n 3 # 4\nv", "f 1 2 \\\n3 #4\nv", "f 1 2\t3"] {
            let mut words = Words { bytes: text.as_bytes(), at: 0 };
            let line: Vec<&[u8]> = std::iter::from_fn(|| words.next_in_line()).collect();
            assert_eq!(line, [&b"f"[..], b"1", b"2", b"3"], "{text:?}");
        }
    }
}
