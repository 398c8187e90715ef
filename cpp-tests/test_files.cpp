// Files: what OpenMesh writes is read, and damaged or foreign files are refused with a code and a message.
#include "support.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <cstring>
#include <fstream>
#include <sstream>

using namespace support;

namespace {

Handle load(const std::filesystem::path &path, Error &error) {
    ar_mesh *out = nullptr;
    const ar_status status = ar_mesh_load(path.string().c_str(), nullptr, &out, &error);
    REQUIRE((status == AR_OK) == (out != nullptr));
    return Handle(out);
}

void refused(const std::filesystem::path &path, ar_status wanted) {
    Error error;
    CHECK_FALSE(load(path, error));
    INFO(path << ": " << ar_status_name(error.status) << ": " << error.message);
    CHECK(error.status == wanted);
    CHECK(std::string(error.message).size() > 8);
    CHECK(std::string(error.message).find('\n') == std::string::npos);
}

// Refused with any of the codes for bad files, or taken (a damaged file may still hold sound faces): but no crash.
void survived(const std::filesystem::path &path) {
    Error error;
    const Handle mesh = load(path, error);
    INFO(path << ": " << ar_status_name(error.status) << ": " << error.message);
    CHECK(error.status != AR_E_INTERNAL);
    if (mesh) {
        CHECK(ar_compute(mesh.get(), nullptr, &error) != AR_E_INTERNAL);
    } else {
        CHECK(std::string(error.message).size() > 8);
    }
}

std::string replaced(std::string text, char from, char to) {
    for (char &c : text) {
        c = c == from ? to : c;
    }
    return text;
}

} // namespace

TEST_CASE("STL, OBJ and PLY files written by OpenMesh", "[files]") {
    const TemporaryFolder folder;
    const shapes::Mesh mesh = shapes::box(4, 3, 2, 0.5); // exact in float and in short decimals
    const Field wanted = compute(through_openmesh(mesh));
    struct Kind {
        const char *name;
        bool binary;
    };
    for (const Kind &kind : {Kind{"a.stl", false}, Kind{"b.stl", true}, Kind{"c.obj", false}, Kind{"d.ply", false}, Kind{"e.ply", true}}) {
        INFO(kind.name << (kind.binary ? ", binary" : ", ASCII"));
        openmesh_write(mesh, folder / kind.name, kind.binary);
        Error error;
        const Handle loaded = load(folder / kind.name, error);
        INFO(error.message);
        REQUIRE(loaded);
        const ar_diagnostics d = diagnostics(loaded);
        CHECK(d.vertex_count == mesh.points.size());
        CHECK(d.face_count == mesh.triangles.size());
        CHECK(d.closed == 1);
        CHECK(d.volume == Approx(24).epsilon(1e-9));
        const Field field = compute(loaded);
        CHECK(std::fabs(field.summary.ratio_max / wanted.summary.ratio_max - 1) <= 1e-3);
        CHECK(std::fabs(field.summary.d2_mean / wanted.summary.d2_mean - 1) <= 1e-3);

        const Field other_way = compute(openmesh_read(folder / kind.name));
        CHECK(std::fabs(other_way.summary.ratio_max / wanted.summary.ratio_max - 1) <= 1e-3);
    }
}

TEST_CASE("files that are no mesh", "[files]") {
    const TemporaryFolder folder;
    const std::string binary = shapes::binary_stl(shapes::box(4, 3, 2, 1)), ascii = shapes::ascii_stl(shapes::box(4, 3, 2, 1));
    refused(folder / "missing.stl", AR_E_IO);
    refused(folder / "", AR_E_IO); // a folder
    for (const char *name : {"empty.stl", "empty.obj", "empty.ply", "empty.3mf"}) {
        refused(folder.file(name, ""), AR_E_FORMAT);
    }
    refused(folder.file("text.stl", "this is a shopping list: bread, milk, titanium\n"), AR_E_FORMAT);
    refused(folder.file("text.ply", "this is a shopping list: bread, milk, titanium\n"), AR_E_FORMAT);
    refused(folder.file("not-a-zip.3mf", "PK this is no zip archive"), AR_E_FORMAT);
    refused(folder.file("zip-without-model.3mf", std::string("PK\5\6") + std::string(18, '\0')), AR_E_FORMAT);
    refused(folder.file("image.stl", "\x89PNG\r\n\x1a\n" + std::string(200, 'x')), AR_E_FORMAT);
    refused(folder.file("zeros.stl", std::string(84, '\0')), AR_E_EMPTY);
    refused(folder.file("unknown.xyz", std::string(100, '?')), AR_E_FORMAT);
    refused(folder.file("truncated.stl", binary.substr(0, binary.size() / 2)), AR_E_FORMAT);
    refused(folder.file("header-only.stl", binary.substr(0, 83)), AR_E_FORMAT);
    refused(folder.file("truncated-ascii.stl", ascii.substr(0, ascii.size() / 2)), AR_E_FORMAT);
}

TEST_CASE("ASCII STL with a comma for the decimal point", "[files]") {
    const TemporaryFolder folder;
    shapes::Mesh mesh = shapes::box(1.5, 2.5, 3.5, 0.5);
    const std::string commas = replaced(shapes::ascii_stl(mesh), '.', ',');
    REQUIRE(commas.find("1,5") != std::string::npos);
    Error error;
    const Handle loaded = load(folder.file("commas.stl", commas), error);
    if (loaded) { // read as what it means, never as 15 or 1
        CHECK(diagnostics(loaded).volume == Approx(1.5 * 2.5 * 3.5));
    } else {
        CHECK(error.status == AR_E_FORMAT);
        CHECK(std::string(error.message).size() > 8);
    }
}

TEST_CASE("binary STL whose count lies", "[files]") {
    const TemporaryFolder folder;
    const shapes::Mesh mesh = shapes::box(4, 3, 2, 1);
    const std::string good = shapes::binary_stl(mesh);
    const auto with_count = [&](std::uint32_t count) {
        std::string out = good;
        std::memcpy(&out[80], &count, 4);
        return out;
    };
    const auto n = static_cast<std::uint32_t>(mesh.triangles.size());
    for (const std::uint32_t count : {0u, 1u, n - 1, n + 1, 1000 * n, 0x7FFFFFFFu, 0xFFFFFFFFu}) {
        INFO("says " << count << ", holds " << n);
        Error error;
        const Handle loaded = load(folder.file("lies.stl", with_count(count)), error);
        // either refused, or read for what it holds: never more faces than there are, never a silent part of them
        if (loaded) {
            CHECK(diagnostics(loaded).face_count == n);
            std::size_t length = 0;
            check(ar_mesh_get_warnings(loaded.get(), nullptr, 0, &length, &error), error);
            CHECK(length > 1);
        } else {
            CHECK((error.status == AR_E_FORMAT || error.status == AR_E_EMPTY));
        }
    }
}

TEST_CASE("every truncation and many single-byte changes of good files are survived", "[files]") {
    const TemporaryFolder folder;
    const shapes::Mesh mesh = shapes::box(1, 1, 1, 0);
    openmesh_write(mesh, folder / "x.obj", false);
    openmesh_write(mesh, folder / "x.ply", true);
    openmesh_write(mesh, folder / "y.ply", false);
    const auto content = [&](const char *name) {
        std::ifstream in(folder / name, std::ios::binary);
        std::stringstream text;
        text << in.rdbuf();
        return text.str();
    };
    const std::pair<const char *, std::string> files[] = {{"b.stl", shapes::binary_stl(mesh)},
                                                          {"a.stl", shapes::ascii_stl(mesh)},
                                                          {"o.obj", content("x.obj")},
                                                          {"p.ply", content("x.ply")},
                                                          {"q.ply", content("y.ply")}};
    for (const auto &[name, good] : files) {
        REQUIRE(good.size() > 100);
        for (std::size_t length = 0; length < good.size(); length += 1 + good.size() / 60) {
            survived(folder.file(name, good.substr(0, length)));
        }
        unsigned seed = 1;
        for (int k = 0; k < 150; ++k) {
            seed = seed * 1664525 + 1013904223;
            std::string bad = good;
            bad[(seed >> 8) % bad.size()] = static_cast<char>(seed >> 24);
            survived(folder.file(name, bad));
        }
    }
}

TEST_CASE("coloured PLY holds the results", "[files]") {
    const TemporaryFolder folder;
    const Handle mesh = through_openmesh(shapes::box(4, 3, 2, 1));
    const Field field = compute(mesh);
    Error error;
    check(ar_mesh_write_ply(mesh.get(), (folder / "out.ply").string().c_str(), AR_RATIO, &error), error);
    std::ifstream in(folder / "out.ply", std::ios::binary);
    std::string line;
    std::vector<std::string> types, names;
    std::size_t vertices = 0;
    bool in_vertex = false;
    while (std::getline(in, line) && line != "end_header") {
        if (line.rfind("element vertex ", 0) == 0) {
            vertices = std::stoul(line.substr(15));
            in_vertex = true;
        } else if (line.rfind("element", 0) == 0) {
            in_vertex = false;
        } else if (in_vertex && line.rfind("property", 0) == 0) {
            const std::size_t space = line.find(' ', 9);
            types.push_back(line.substr(9, space - 9));
            names.push_back(line.substr(space + 1));
        }
    }
    CHECK(vertices == field.d1.size());
    REQUIRE(names == std::vector<std::string>{"x", "y", "z", "red", "green", "blue", "d1", "d2", "ratio", "quality"});
    const auto value = [&](const std::string &type) -> double {
        if (type == "uchar") {
            return in.get();
        }
        if (type == "float") {
            float v = 0;
            in.read(reinterpret_cast<char *>(&v), sizeof v);
            return v;
        }
        REQUIRE(type == "double");
        double v = 0;
        in.read(reinterpret_cast<char *>(&v), sizeof v);
        return v;
    };
    for (std::size_t v = 0; v < vertices; ++v) {
        std::vector<double> row;
        for (const std::string &type : types) {
            row.push_back(value(type));
        }
        CHECK(row[6] == Approx(field.d1[v]).epsilon(1e-6));
        CHECK(row[7] == Approx(field.d2[v]).epsilon(1e-6));
        CHECK(row[8] == Approx(field.ratio[v]).epsilon(1e-6));
        CHECK(row[9] == row[8]);
    }
    // and it is a mesh again
    const Handle again = load(folder / "out.ply", error);
    REQUIRE(again);
    CHECK(diagnostics(again).volume == Approx(24));
}
