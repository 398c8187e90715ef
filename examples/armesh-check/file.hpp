// An output file that appears whole or not at all: written under a temporary name beside its place, renamed at the end.
#pragma once

#include <string>

namespace check {

class OutputFile {
  public:
    // Reserves a temporary name for `path`. Throws std::runtime_error if nothing can be written there.
    explicit OutputFile(std::string path);
    ~OutputFile();
    OutputFile(const OutputFile &) = delete;
    OutputFile &operator=(const OutputFile &) = delete;

    // Where to write until commit().
    const std::string &temporary() const { return temporary_; }

    // Writes `text` to the temporary file. Throws std::runtime_error.
    void write(const std::string &text) const;

    // Gives the file its name. Throws std::runtime_error.
    void commit();

  private:
    std::string path_;
    std::string temporary_;
    bool in_place_ = false; // the path is a device or a pipe: renaming onto it would replace it
    bool committed_ = false;
};

} // namespace check
