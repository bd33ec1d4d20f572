#include "common/log/log.h"

#include <spdlog/logger.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/null_sink.h>
#include <spdlog/sinks/rotating_file_sink.h>
#include <spdlog/sinks/stdout_sinks.h>

#include <algorithm>
#include <mutex>
#include <nlohmann/json.hpp>

#include "common/json/json.h"

namespace gapfarm {
namespace {

spdlog::level::level_enum spdlog_level(LogLevel level) {
  using namespace spdlog::level;
  constexpr level_enum kLevels[] = {debug, info, warn, err, off};
  return kLevels[static_cast<std::size_t>(level)];
}

std::string json_of(const nlohmann::json& value) { return json_text(value); }

std::string json_of(const LogField& field) {
  return std::visit([](const auto& value) { return json_of(nlohmann::json(value)); }, field.value);
}

// As it is when that reads as one word.
std::string word_of(const LogField& field) {
  const auto* text = std::get_if<std::string>(&field.value);
  const bool plain = text != nullptr && !text->empty() &&
                     std::all_of(text->begin(), text->end(), [](unsigned char c) {
                       return c > ' ' && c != '"' && c != '\\' && c != '=' && c < 0x7f;
                     });
  return plain ? *text : json_of(field);
}

// What came from elsewhere cannot begin a line or steer a terminal.
std::string one_line(std::string_view text) {
  std::string result(text);
  std::replace_if(
      result.begin(), result.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, '?');
  return result;
}

std::unique_ptr<spdlog::formatter> formatter_of(const LogOptions& options) {
  const std::string time = "%Y-%m-%dT%H:%M:%S.%eZ";
  const std::string pattern = options.format == LogFormat::kJson
                                  ? "{\"time\":\"" + time + "\",\"level\":\"%l\",%v}"
                                  : time + " %l " + options.program + ": %v";
  return std::make_unique<spdlog::pattern_formatter>(pattern, spdlog::pattern_time_type::utc);
}

}  // namespace

struct Log::Impl {
  Impl(const std::string& program, spdlog::sink_ptr sink) : logger(program, std::move(sink)) {}
  spdlog::logger logger;
  std::mutex mutex;
  std::vector<LogField> context;
  Log* copy = nullptr;
};

Log::Log(const LogOptions& options) : format_(options.format) {
  spdlog::sink_ptr sink;
  if (options.file.empty()) {
    sink = std::make_shared<spdlog::sinks::stderr_sink_mt>();
  } else {
    try {
      sink = std::make_shared<spdlog::sinks::rotating_file_sink_mt>(options.file,
                                                                    options.file_bytes, 1);
    } catch (const std::exception& e) {
      trouble_ = e.what();
      sink = std::make_shared<spdlog::sinks::null_sink_mt>();
    }
  }
  impl_ = std::make_unique<Impl>(options.program, std::move(sink));
  // A full disk is no reason to stop, nor to repeat it for every line.
  if (!options.file.empty()) impl_->logger.set_error_handler([](const std::string&) {});
  impl_->logger.set_formatter(formatter_of(options));
  impl_->logger.set_level(spdlog_level(options.level));
  impl_->logger.flush_on(spdlog::level::trace);
}

Log::~Log() = default;

bool Log::wants(LogLevel level) const { return impl_->logger.should_log(spdlog_level(level)); }

void Log::set(LogField field) {
  const std::lock_guard lock(impl_->mutex);
  const auto same = std::ranges::find(impl_->context, field.key, &LogField::key);
  if (same == impl_->context.end()) {
    impl_->context.push_back(std::move(field));
  } else {
    same->value = std::move(field.value);
  }
}

void Log::copy_to(Log* other) {
  const std::lock_guard lock(impl_->mutex);
  impl_->copy = other;
}

void Log::write(LogLevel level, std::string_view text, const std::vector<LogField>& fields) {
  Log* copy = nullptr;
  {
    const std::lock_guard lock(impl_->mutex);
    copy = impl_->copy;
  }
  if (copy != nullptr) copy->write(level, text, fields);
  if (!wants(level)) return;
  const bool json = format_ == LogFormat::kJson;
  std::string line = json ? "\"text\":" + json_of(nlohmann::json(text)) : one_line(text);
  const auto add = [&](const LogField& field) {
    line += json ? "," + json_of(nlohmann::json(field.key)) + ":" + json_of(field)
                 : " " + field.key + "=" + word_of(field);
  };
  {
    const std::lock_guard lock(impl_->mutex);
    for (const LogField& field : impl_->context) add(field);
  }
  for (const LogField& field : fields) add(field);
  impl_->logger.log(spdlog_level(level), spdlog::string_view_t(line.data(), line.size()));
}

}  // namespace gapfarm
