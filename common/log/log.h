// Structured logs on stderr or in a file: a sentence for people with fields for machines.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace gapfarm {

enum class LogLevel { kDebug, kInfo, kWarn, kError, kOff };
enum class LogFormat {
  kText,  // 2026-01-31T12:00:00.000Z warn gapfarm: it is late worker=rack3-1
  kJson,  // {"time":"2026-01-31T12:00:00.000Z","level":"warn","text":"it is
          // late","worker":"rack3-1"}
};

// run, generation, job, attempt, worker, host: the same key for the same thing everywhere.
struct LogField {
  std::string key;
  std::variant<std::string, std::uint64_t, double> value;
};

struct LogOptions {
  std::string program;  // for people
  LogFormat format = LogFormat::kText;
  LogLevel level = LogLevel::kWarn;
  // Of lines; where to write them instead of stderr: the last one to two of these many bytes stay,
  // in `file` and, before them, in what it is called with ".1" ahead of its extension.
  std::string file;
  std::size_t file_bytes = std::size_t{1} << 20;
};

// Nothing is ever lost without a word: writing is synchronous.  Thread-safe.
class Log {
 public:
  // A file that cannot be opened: nothing is written; trouble() says why.
  explicit Log(const LogOptions& options);
  ~Log();
  Log& operator=(Log&&) = delete;

  bool wants(LogLevel level) const;
  // One line.  Text and values may hold anything.
  void write(LogLevel level, std::string_view text, const std::vector<LogField>& fields = {});

  // Every later line carries this field; a second call with its key replaces it.
  void set(LogField field);

  // Every line goes to `other` too, as its own level has it; null: no more.  It outlives this or
  // is taken back.
  void copy_to(Log* other);

  LogFormat format() const { return format_; }
  const std::string& trouble() const { return trouble_; }

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  LogFormat format_;
  std::string trouble_;
};

}  // namespace gapfarm
