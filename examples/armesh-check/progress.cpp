#include "progress.hpp"

#include <csignal>
#include <cstdio>

#ifdef _WIN32
#include <io.h>
#define isatty _isatty
#define fileno _fileno
#else
#include <unistd.h>
#endif

namespace check {
namespace {

volatile std::sig_atomic_t interrupt_seen = 0;
const ar_cancel_token *volatile interrupt_token = nullptr;

extern "C" void on_interrupt(int signal) {
    std::signal(signal, SIG_DFL);
    interrupt_seen = 1;
    if (interrupt_token != nullptr) {
        ar_cancel_token_cancel(interrupt_token, nullptr); // safe in a signal handler
    }
}

} // namespace

ProgressBar::ProgressBar(bool wanted) : on_(wanted && isatty(fileno(stderr)) != 0) {}

ProgressBar::~ProgressBar() {
    if (!last_.empty()) {
        std::fprintf(stderr, "\r%*s\r", static_cast<int>(last_.size()), "");
        std::fflush(stderr);
    }
}

void ProgressBar::show(double fraction, const char *stage) {
    if (!on_) {
        return;
    }
    constexpr int width = 40;
    const int full = static_cast<int>(fraction * width);
    std::string bar(static_cast<std::size_t>(full), '#');
    bar.resize(width, '.');
    char line[128];
    std::snprintf(line, sizeof line, "[%s] %3d %%  %-10.16s", bar.c_str(), static_cast<int>(fraction * 100), stage);
    if (last_ != line) {
        last_ = line;
        std::fprintf(stderr, "\r%s", line);
        std::fflush(stderr);
    }
}

CancelOnInterrupt::CancelOnInterrupt(const armesh::cancel_token &token) {
    interrupt_token = token.get();
    std::signal(SIGINT, on_interrupt);
}

CancelOnInterrupt::~CancelOnInterrupt() {
    std::signal(SIGINT, SIG_DFL);
    interrupt_token = nullptr;
}

bool CancelOnInterrupt::interrupted() { return interrupt_seen != 0; }

} // namespace check
