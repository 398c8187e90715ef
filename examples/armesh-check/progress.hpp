// The progress bar, and Ctrl-C.
#pragma once

#include <armesh.hpp>

#include <string>

namespace check {

// A bar on standard error while it is a terminal and the caller wants one.
class ProgressBar {
  public:
    explicit ProgressBar(bool wanted);
    ~ProgressBar(); // wipes the bar

    // Shows `fraction` 0..1 of the work and the name of the stage.
    void show(double fraction, const char *stage);

  private:
    bool on_;
    std::string last_;
};

// While one lives, Ctrl-C raises `token`; a second Ctrl-C ends the program at once.
class CancelOnInterrupt {
  public:
    explicit CancelOnInterrupt(const armesh::cancel_token &token);
    ~CancelOnInterrupt();

    // True after Ctrl-C.
    static bool interrupted();
};

} // namespace check
