#include <filesystem>

#include "common/trials/files.h"
#include "master/io/logs/bags.h"

namespace gapfarm {

Result<FileSource> FileSource::open(const std::string& path) {
  std::error_code code;
  if (std::filesystem::is_directory(path, code)) {
    return Error{path + ": a folder; give the file in it (.db3, .mcap, .bag or .csv)"};
  }
  FileSource source;
  source.file_.open(path, std::ios::binary);
  source.size_ = std::filesystem::file_size(path, code);
  if (!source.file_ || code) {
    return Error{path + ": no such file, or it cannot be read; check the path"};
  }
  return source;
}

bool FileSource::read(std::uint64_t offset, std::size_t count, std::string& to) {
  if (offset > size_ || size_ - offset < count) return false;
  to.resize(count);
  file_.clear();
  file_.seekg(static_cast<std::streamoff>(offset));
  file_.read(to.data(), static_cast<std::streamsize>(count));
  return file_.gcount() == static_cast<std::streamsize>(count);
}

Result<Recording> read_recording(const std::string& path) {
  Result<FileSource> source = FileSource::open(path);
  if (!source) return source.error();
  std::string head;
  source->read(0, std::min<std::uint64_t>(source->size(), 16), head);
#define FORMAT(file, begins) \
  if (head.rfind(begins, 0) == 0) return read_##file(*source, path);
#include "master/io/logs/formats.inc"
  const Result<std::string> text = read_text_file(path);
  if (!text) return text.error();
  return parse_text_log(*text, path);
}

}  // namespace gapfarm
