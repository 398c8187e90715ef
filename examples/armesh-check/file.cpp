#include "file.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <random>
#include <stdexcept>
#include <system_error>

namespace check {
namespace fs = std::filesystem;
namespace {

[[noreturn]] void fail(const std::string &path, const std::string &why) {
    throw std::runtime_error("cannot write '" + path + "': " + why);
}

} // namespace

OutputFile::OutputFile(std::string path) : path_(std::move(path)) {
    std::error_code error;
    const fs::file_status status = fs::status(path_, error); // follows links
    if (fs::is_directory(status)) {
        fail(path_, "it is a folder");
    }
    if (fs::exists(status) && !fs::is_regular_file(status)) {
        in_place_ = true;
        temporary_ = path_;
        return;
    }
    if (fs::is_symlink(fs::symlink_status(path_, error))) {
        const fs::path target = fs::weakly_canonical(path_, error); // replace what the link names, not the link
        if (!error) {
            path_ = target.string();
        }
    }
    const unsigned tag = std::random_device{}();
    temporary_ = path_ + ".tmp-" + std::to_string(tag);
    std::FILE *probe = std::fopen(temporary_.c_str(), "wb"); // so that a bad path is known before the long work
    if (probe == nullptr) {
        fail(path_, std::strerror(errno));
    }
    std::fclose(probe);
}

OutputFile::~OutputFile() {
    if (!committed_ && !in_place_) {
        std::remove(temporary_.c_str());
    }
}

void OutputFile::write(const std::string &text) const {
    std::FILE *file = std::fopen(temporary_.c_str(), "wb");
    if (file == nullptr) {
        fail(path_, std::strerror(errno));
    }
    const bool wrote = std::fwrite(text.data(), 1, text.size(), file) == text.size();
    const int why = errno;
    if (std::fclose(file) != 0 || !wrote) {
        fail(path_, std::strerror(wrote ? errno : why));
    }
}

void OutputFile::commit() {
    if (!in_place_) {
        std::error_code error;
        fs::rename(temporary_, path_, error);
        if (error) {
            fail(path_, error.message());
        }
    }
    committed_ = true;
}

} // namespace check
