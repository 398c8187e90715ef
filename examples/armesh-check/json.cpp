// The report as JSON; README.md describes the fields.
#include "format.hpp"
#include "report.hpp"

#include <cmath>

namespace check {
namespace {

std::string number(double value) { return exact(value, "null"); }
std::string number(std::uint64_t value) { return std::to_string(value); }
std::string number(const Point &p) { return "[" + number(p[0]) + ", " + number(p[1]) + ", " + number(p[2]) + "]"; }
std::string truth(bool value) { return value ? "true" : "false"; }

// An object or array under construction; fields go one per line.
class Block {
  public:
    Block(char open, char close, int depth) : text_(1, open), close_(close), indent_(2 * depth, ' ') {}
    Block &add(const std::string &value) {
        text_ += (empty_ ? "\n" : ",\n") + indent_ + "  " + value;
        empty_ = false;
        return *this;
    }
    Block &field(const std::string &key, const std::string &value) { return add("\"" + key + "\": " + value); }
    std::string done() { return text_ + (empty_ ? "" : "\n" + indent_) + close_; }

  private:
    std::string text_;
    char close_;
    std::string indent_;
    bool empty_ = true;
};

std::string findings(const std::vector<Finding> &all) {
    Block block('{', '}', 2);
    for (const Finding &f : all) {
        std::string value = "{\"count\": " + number(f.count);
        if (f.located) {
            value += std::string(f.first_is_vertex ? ", \"first_vertex\": " : ", \"first_face\": ") + number(f.first) +
                     ", \"at\": " + number(f.at);
        }
        block.field(f.key, value + "}");
    }
    return block.done();
}

std::string strings(const std::vector<std::string> &all) {
    Block block('[', ']', 2);
    for (const std::string &text : all) {
        block.add(json_string(text));
    }
    return block.done();
}

std::string mesh(const MeshFacts &m) {
    return Block('{', '}', 1)
        .field("vertices", number(m.vertices))
        .field("faces", number(m.faces))
        .field("components", number(m.components))
        .field("closed", truth(m.closed))
        .field("area", number(m.area))
        .field("volume", number(m.volume))
        .field("bounding_box", "[" + number(m.low) + ", " + number(m.high) + "]")
        .field("unit", m.unit[0] != '\0' ? json_string(m.unit) : "null")
        .field("findings", findings(m.findings))
        .field("warnings", strings(m.warnings))
        .done();
}

std::string summary(const Summary &s) {
    return Block('{', '}', 1)
        .field("d1_max", number(s.d1_max))
        .field("d1_mean", number(s.d1_mean))
        .field("d2_max", number(s.d2_max))
        .field("d2_mean", number(s.d2_mean))
        .field("d2_min", number(s.d2_min))
        .field("ratio_max", number(s.ratio_max))
        .field("ratio_mean", number(s.ratio_mean))
        .field("vertex_ratio_max", number(s.vertex_ratio_max))
        .field("d1_max_at", number(s.d1_max_at))
        .field("d1_max_far", number(s.d1_max_far))
        .field("d2_max_at", number(s.d2_max_at))
        .field("d2_min_at", number(s.d2_min_at))
        .field("vertex_ratio_max_at", number(s.vertex_ratio_max_at))
        .field("unmeasured_vertices", number(s.unmeasured))
        .field("solves", number(s.solves))
        .field("d1_method", "\"" + std::string(s.d1_method) + "\"")
        .field("d1_error", number(s.d1_error))
        .field("d1_gap", number(s.d1_gap))
        .field("seconds", number(s.seconds))
        .done();
}

std::string worst(const std::vector<Place> &places) {
    Block block('[', ']', 1);
    for (const Place &p : places) {
        block.add("{\"ratio\": " + number(p.ratio) + ", \"d1\": " + number(p.d1) + ", \"d2\": " + number(p.d2) +
                  ", \"vertex\": " + number(p.vertex) + ", \"at\": " + number(p.at) + ", \"far\": " + number(p.far) + "}");
    }
    return block.done();
}

// The members of the JSON object that the library's report is, to stand among others.
std::string members(const std::string &object) {
    const auto open = object.find('{'), close = object.rfind('}');
    const auto first = object.find_first_not_of(" \n", open + 1), last = object.find_last_not_of(" \n", close - 1);
    return object.substr(first, last + 1 - first);
}

} // namespace

std::string to_json(const Report &r) {
    const std::string options = Block('{', '}', 1)
                                    .field("profile", json_string(r.args.paper ? "paper" : "print"))
                                    .field("rays", number(std::uint64_t{r.rays}))
                                    .field("cone_degrees", number(r.cone_degrees))
                                    .done();
    return Block('{', '}', 0)
               .field("schema", "\"armesh-check/1\"")
               .field("armesh", json_string(r.library_version))
               .field("file", json_string(r.args.part))
               .field("options", options)
               .field("limit", number(r.args.limit))
               .field("over_limit", truth(r.over()))
               .field("summary", summary(r.summary))
               .field("worst", worst(r.worst))
               .field("mesh", mesh(r.mesh))
               .add(members(r.library_report))
               .done() +
           "\n";
}

} // namespace check
