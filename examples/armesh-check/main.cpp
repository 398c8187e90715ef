// armesh-check: measures a part's slenderness through libarmesh's public headers and says whether it is too much.
// Exit status: 0 nothing at or over the limits, 1 something is, 2 wrong usage or bad input, 130 stopped by Ctrl-C.
#include "args.hpp"
#include "file.hpp"
#include "measure.hpp"
#include "progress.hpp"
#include "report.hpp"

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace {

using namespace check;

enum Exit { kUnder = 0, kOver = 1, kBad = 2, kInterrupted = 130 };

// The library frees large arrays from step to step. Left alone, glibc raises its limits with every one of them, keeps the
// memory, and a process ends at half as much again as it ever used. Small parts are faster that way, and stay small.
void give_freed_memory_back(const std::string &part) {
#ifdef __GLIBC__
    constexpr std::uintmax_t large = 4 << 20;
    std::error_code unknown;
    const auto size = std::filesystem::file_size(part, unknown);
    if (!unknown && size > large) {
        mallopt(M_MMAP_THRESHOLD, 1 << 20);
        mallopt(M_TRIM_THRESHOLD, 4 << 20);
    }
#else
    (void)part;
#endif
}

int run(const Args &args) {
    // names first: a typing error in a path must not cost the whole computation
    const auto output = [](const std::string &path) {
        return path.empty() ? nullptr : std::make_unique<OutputFile>(path);
    };
    const auto json = output(args.json), csv = output(args.vertex_csv), ply = output(args.ply),
               feature_ply = output(args.feature_ply);

    const armesh::cancel_token token;
    const CancelOnInterrupt on_interrupt(token);
    std::optional<armesh::mesh> mesh;
    const Report report = measure(args, token, mesh);
    if (std::isnan(report.summary.ratio_max)) {
        throw std::runtime_error("nothing could be measured: no vertex has both a D1 and a D2");
    }

    if (json) {
        json->write(to_json(report));
    }
    if (csv) {
        csv->write(to_csv(report));
    }
    if (ply) {
        mesh->write_ply(ply->temporary(), armesh::quantity::ratio);
    }
    if (feature_ply) {
        mesh->write_features_ply(feature_ply->temporary());
    }
    if (CancelOnInterrupt::interrupted()) {
        throw armesh::error(AR_E_CANCELLED, "stopped");
    }
    for (OutputFile *file : {json.get(), csv.get(), ply.get(), feature_ply.get()}) {
        if (file != nullptr) {
            file->commit();
        }
    }
    if (!args.quiet) {
        std::fputs(to_table(report).c_str(), stdout);
        if (std::fflush(stdout) != 0) {
            throw std::runtime_error("cannot write to standard output");
        }
    }
    return report.over() ? kOver : kUnder;
}

} // namespace

int main(int argc, char **argv) {
    std::string part;
    try {
        const Args args = parse_args(argc, argv);
        if (args.help) {
            std::fputs(help_text(), stdout);
            return kUnder;
        }
        if (args.version) {
            std::printf("armesh-check %s\n", armesh::version());
            return kUnder;
        }
        part = args.part;
        give_freed_memory_back(part);
        return run(args);
    } catch (const armesh::error &error) {
        if (error.status() == AR_E_CANCELLED && CancelOnInterrupt::interrupted()) {
            std::fprintf(stderr, "armesh-check: stopped\n");
            return kInterrupted;
        }
        std::fprintf(stderr, "armesh-check: %s: %s\n", part.c_str(), error.what());
    } catch (const std::exception &error) {
        std::fprintf(stderr, "armesh-check: %s\n", error.what());
    }
    return kBad;
}
