#include "master/command/farm_log.h"

#include <map>

namespace gapfarm {
namespace {

LogLevel level_of(FarmEvent::Kind kind) {
  switch (kind) {
    case FarmEvent::kJoined:
    case FarmEvent::kReturned:
    case FarmEvent::kLeft:
      return LogLevel::kInfo;
    case FarmEvent::kQuarantined:
      return LogLevel::kError;
    default:
      return LogLevel::kWarn;
  }
}

}  // namespace

void LogFlags::declare(CLI::App& app) {
  static const std::map<std::string, LogFormat> kFormats = {{"text", LogFormat::kText},
                                                            {"json", LogFormat::kJson}};
  static const std::map<std::string, LogLevel> kLevels = {{"debug", LogLevel::kDebug},
                                                          {"info", LogLevel::kInfo},
                                                          {"warn", LogLevel::kWarn},
                                                          {"error", LogLevel::kError},
                                                          {"off", LogLevel::kOff}};
  app.add_option("--log-format", format, "Of what goes to stderr: text or json, a line each")
      ->transform(CLI::CheckedTransformer(kFormats).description(""))
      ->type_name("FORMAT");
  app.add_option("--log-level", level,
                 "debug (every job), info, warn, error or off (default: warn; info for json)")
      ->transform(CLI::CheckedTransformer(kLevels).description(""))
      ->type_name("LEVEL");
}

std::unique_ptr<Log> LogFlags::open() const {
  LogOptions options;
  options.program = "gapfarm";
  options.format = format;
  options.level = level.value_or(format == LogFormat::kJson ? LogLevel::kInfo : LogLevel::kWarn);
  return std::make_unique<Log>(options);
}

void report_to(Log& log, SocketFarmOptions& options) {
  options.on_event = [&log](const FarmEvent& event) {
    std::vector<LogField> fields;
    if (!event.worker.empty()) fields.push_back({"worker", event.worker});
    if (!event.host.empty()) fields.push_back({"host", event.host});
    log.write(level_of(event.kind), event.text, fields);
  };
  if (!log.wants(LogLevel::kDebug)) return;
  options.on_job = [&log](const JobEvent& event) {
    log.write(LogLevel::kDebug, event.answered ? "job answered" : "job given out",
              {{"job", event.job},
               {"attempt", event.attempt},
               {"worker", event.worker},
               {"host", event.host}});
  };
}

void report_to(Console& console, SocketFarmOptions& options) {
  options.on_event = [&console](const FarmEvent& event) {
    const std::string text =
        (event.worker.empty() ? std::string() : "worker " + event.worker + ": ") + event.text;
    // Not what the command fails with: it may go on.
    if (level_of(event.kind) != LogLevel::kInfo) return console.note("gapfarm: " + text);
    if (console.kept() != nullptr) console.kept()->write(LogLevel::kInfo, text);
  };
}

}  // namespace gapfarm
