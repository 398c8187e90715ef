// The talk with libarmesh: from a file name to a Report.
#pragma once

#include "report.hpp"

#include <armesh.hpp>

namespace check {

// Loads and measures args.part, showing progress on standard error unless args.quiet. `loaded` receives the mesh, for the
// PLY writer. Throws armesh::error.
Report measure(const Args &args, const armesh::cancel_token &token, std::optional<armesh::mesh> &loaded);

} // namespace check
