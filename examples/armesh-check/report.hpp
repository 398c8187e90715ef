// What armesh-check knows about a part after measuring it, and the ways to write it down.
#pragma once

#include "args.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace check {

using Point = std::array<double, 3>;

// One kind of flaw of the mesh.
struct Finding {
    const char *key;       // in the JSON
    const char *words;     // for people, plural
    std::uint64_t count;   // 0: the mesh has none
    bool located;          // `first` and `at` are set
    std::uint64_t first;   // index of the first face or vertex
    bool first_is_vertex;  // rather than a face
    Point at;              // where that is
};

struct MeshFacts {
    std::uint64_t vertices, faces, components;
    bool closed;
    double area, volume;
    Point low, high; // bounding box
    const char *unit; // "" if the file does not say
    std::vector<Finding> findings;
    std::vector<std::string> warnings; // what was odd in the file, a sentence each
};

// A place on the part with its length, width and slenderness.
struct Place {
    std::uint64_t vertex;
    Point at;
    Point far; // the farthest place from it, where d1 ends
    double d1, d2, ratio;
};

struct Summary {
    double d1_max, d1_mean, d2_max, d2_mean, d2_min, ratio_max, ratio_mean, vertex_ratio_max;
    Point d1_max_at, d1_max_far, d2_max_at, d2_min_at, vertex_ratio_max_at;
    std::uint64_t unmeasured; // vertices without a ratio
    std::uint64_t solves;     // geodesic solves
    const char *d1_method;    // what the distances were solved for by
    double d1_error, d1_gap;  // estimated relative error (NaN: unknown), and the widest bounds of a vertex
    double seconds = 0;       // everything from the file to the numbers
};

// A feature of the part.
struct Feature {
    std::uint32_t id;
    const char *kind;     // "body", "bar", "wall", "ring"
    const char *severity; // "ok", "warning", "ERROR"
    bool error, listed, slender, thin;
    double ratio, length, width, thickness, least; // least: the least width on it
    Point centroid, least_at;
    Point ends[2]; // of its length
};

struct Report {
    Args args;
    std::string library_version;
    double cone_degrees; // as used
    unsigned rays;       // as used
    MeshFacts mesh;
    Summary summary;
    std::vector<Place> worst; // most slender first, well apart from each other
    std::vector<Point> positions;
    std::vector<double> d1, d2, ratio; // one per vertex, NaN where there is no value
    std::vector<Feature> features;     // worst first
    std::string library_report;        // the features as the library's JSON
    bool over() const {
        for (const Feature &f : features) {
            if (f.error) {
                return true;
            }
        }
        return summary.ratio_max >= args.limit;
    }
};

std::string to_table(const Report &report);
std::string to_json(const Report &report);
std::string to_csv(const Report &report);

} // namespace check
