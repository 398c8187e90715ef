// The talk with libarmesh: from a file name to a Report.
#pragma once

#include "report.hpp"

#include <armesh.h>

#include <memory>
#include <stdexcept>

namespace check {

// The library refused; what() is its message.
struct LibraryError : std::runtime_error {
    LibraryError(ar_status code, const std::string &message) : std::runtime_error(message), status(code) {}
    ar_status status;
};

struct FreeMesh {
    void operator()(ar_mesh *mesh) const { ar_mesh_free(mesh); }
};
using Mesh = std::unique_ptr<ar_mesh, FreeMesh>;

struct FreeToken {
    void operator()(ar_cancel_token *token) const { ar_cancel_token_free(token); }
};
using CancelToken = std::unique_ptr<ar_cancel_token, FreeToken>;

CancelToken make_token();

// Loads and measures args.part, showing progress on standard error unless args.quiet. `mesh` receives the handle, for
// save_ply(). Throws LibraryError.
Report measure(const Args &args, ar_cancel_token *token, Mesh &mesh);

// Writes the mesh coloured by D1/D2. Throws LibraryError.
void save_ply(const Mesh &mesh, const std::string &path);

} // namespace check
