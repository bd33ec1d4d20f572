#include "common/trials/files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
#include <system_error>

namespace gapfarm {
namespace {

Status write_all(int fd, std::string_view bytes, const std::string& path) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(fd, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return Error{path + ": cannot be written: " + std::strerror(errno)};
    bytes.remove_prefix(static_cast<std::size_t>(n));
  }
  return {};
}

}  // namespace

Result<std::string> read_text_file(const std::string& path) {
  std::error_code code;
  const auto status = std::filesystem::status(path, code);
  if (!std::filesystem::exists(status)) {
    const std::string whole = whole_path(path);
    return Error{path + ": no such file; check the path" +
                 (whole == path ? "" : ", which leads to " + whole)};
  }
  if (std::filesystem::is_directory(status)) {
    const std::filesystem::path model = std::filesystem::path(path) / "model.toml";
    const bool runs = is_there(std::filesystem::path(path) / "commands.csv");
    return Error{path +
                 (runs ? ": is a folder of runs, expected a file; gapfarm horizons predicts runs"
                       : ": is a folder, expected a file; name " +
                             (is_there(model) ? model.string() : "the files in it"))};
  }
  std::ifstream in(path, std::ios::binary);
  std::ostringstream bytes;
  if (in && in.peek() != std::ifstream::traits_type::eof()) bytes << in.rdbuf();
  if (!in && !in.eof()) {
    return Error{path + ": cannot be read: " + std::strerror(errno) + "; check its permissions"};
  }
  return std::move(bytes).str();
}

namespace {

// Devices and pipes are written to, never renamed over: root could replace /dev/null.
Status write_in_place(const std::string& path, std::string_view bytes) {
  const int fd = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
  if (fd < 0) return Error{path + ": cannot be written: " + std::strerror(errno)};
  const Status written = write_all(fd, bytes, path);
  ::close(fd);
  return written;
}

}  // namespace

namespace {

// Gives the finished file its name.
Status put_in_place(const std::string& temporary, const std::string& path, IfThere if_there) {
  if (if_there == IfThere::kKeep) {
    // A second name, then away with the first: unlike a rename, that never replaces.
    if (::link(temporary.c_str(), path.c_str()) == 0) {
      ::unlink(temporary.c_str());
      return {};
    }
    // Not so on a file system without second names, where a rename has to do.
    if (errno == EEXIST || is_there(path)) {
      return Error{path +
                   ": has appeared meanwhile and stays; what was to be written there is in " +
                   temporary};
    }
  }
  if (::rename(temporary.c_str(), path.c_str()) == 0) return {};
  const Error error{path + ": cannot be replaced: " + std::strerror(errno)};
  ::unlink(temporary.c_str());
  return error;
}

}  // namespace

bool is_there(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::exists(path, ignored);
}

std::string whole_path(const std::string& path) {
  std::error_code code;
  const auto whole = std::filesystem::absolute(path, code);
  return code ? path : whole.string();
}

bool is_folder(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::is_directory(path, ignored);
}

std::string path_from(const std::string& folder, const std::string& path) {
  std::error_code ignored;
  const std::filesystem::path there = (std::filesystem::path(folder) / path).lexically_normal();
  const bool here = std::filesystem::absolute(path, ignored).lexically_normal() == there;
  return !here && is_there(there) ? there.string() : path;
}

Status write_file_atomically(const std::string& given, std::string_view bytes, IfThere if_there,
                             unsigned mode) {
  std::error_code code;
  // Through a link, so that the link stays one.
  std::filesystem::path target(given);
  if (std::filesystem::is_symlink(target, code)) {
    target = std::filesystem::weakly_canonical(target, code);
    if (code) return Error{given + ": cannot be followed: " + code.message()};
  }
  const std::string path = target.string();
  if (std::filesystem::exists(target, code) && !std::filesystem::is_regular_file(target, code) &&
      !std::filesystem::is_directory(target, code)) {
    return write_in_place(path, bytes);
  }
  if (target.has_parent_path()) {
    std::filesystem::create_directories(target.parent_path(), code);
    if (code) {
      return Error{target.parent_path().string() + ": cannot be made: " + code.message()};
    }
  }
  std::string temporary = path + ".XXXXXX";
  const int fd = ::mkstemp(temporary.data());
  if (fd < 0) {
    return Error{path + ": cannot be written: " + std::strerror(errno) +
                 "; check the folder and its permissions"};
  }
  Status written = write_all(fd, bytes, path);
  // The rename may not reach the disk before the bytes do.
  if (written.ok() && ::fsync(fd) != 0) {
    written = Error{path + ": cannot be flushed: " + std::strerror(errno)};
  }
  // mkstemp makes files for the owner alone; give what a plain open would have given.
  const mode_t mask = ::umask(0);
  ::umask(mask);
  ::fchmod(fd, mode & ~mask);
  ::close(fd);
  if (!written.ok()) {
    ::unlink(temporary.c_str());
    return written;
  }
  return put_in_place(temporary, path, if_there);
}

}  // namespace gapfarm
