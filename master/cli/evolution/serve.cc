// gapfarm serve [DIR...]: runs and diagnoses in a browser, from their stores alone.
#include <time.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/base/host.h"
#include "common/base/try.h"
#include "master/cli/evolution/serve_drive.h"
#include "master/cli/subcommand.h"
#include "master/command/page_along.h"
#include "master/run/run_page.h"
#include "master/serve/http_server.h"
#include "master/serve/site.h"
#include "master/store/database.h"
#include "master/store/run_lock.h"

namespace gapfarm {
namespace {

constexpr int kPatience_ms = 500;

struct ServeOptions {
  std::vector<std::string> folders = {"."};
  unsigned port = kPagePort;
};

double thread_cpu_now_s() {
  timespec t = {};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

Result<int> run_serve(const ServeOptions& options, CliContext& context) {
  for (const std::string& folder : options.folders) {
    std::error_code ignored;
    if (std::filesystem::is_directory(folder, ignored)) continue;
    return Error{folder + ": no such folder; name one with runs or diagnoses"};
  }
  // A master commits within milliseconds; who holds a store for longer is not waited for, since
  // everybody else would wait, too.
  set_database_patience_ms(kPatience_ms);
  DriveShower shower(context);
  SiteSources sources;
  sources.folders.assign(options.folders.begin(), options.folders.end());
  sources.unix_now_s = unix_now_s;
  sources.cpu_now_s = thread_cpu_now_s;
  sources.read_run = read_run_report;
  sources.drive = [&](const DriveQuestion& question) { return shower.show(question); };
  Site site(std::move(sources));
  ASSIGN_OR_RETURN(auto server, HttpServer::listen(static_cast<std::uint16_t>(options.port),
                                                   [&](const HttpRequest& request) {
                                                     return site.answer(request);
                                                   }));
  const std::string port = std::to_string(server->port());
  const std::string address = "http://127.0.0.1:" + port + "/";
  const std::string tunnel = "ssh -L " + port + ":127.0.0.1:" + port + " " + host_name();
  context.console.result(
      "serving " + address + "\nfrom another machine: " + tunnel + ", then open " + address + "\n",
      {{"address", address}, {"ssh", tunnel}});
  server->run(context.stop.fd());
  return kExitSignalBase + context.stop.signal();
}

}  // namespace

SubcommandRun setup_serve(CLI::App& app) {
  auto options = std::make_shared<ServeOptions>();
  app.add_option("DIR", options->folders, "Folders; what lies up to four folders beneath is found")
      ->capture_default_str();
  app.add_option("--port", options->port, "On 127.0.0.1; 0: any that is free")
      ->check(CLI::Range(0u, 65535u))
      ->capture_default_str();
  app.footer(
      "Examples:\n"
      "  gapfarm serve\n"
      "  gapfarm serve run diagnosis --port 9000\n"
      "It reads stores and needs no master; nothing can be changed through it.  Ctrl-C ends it.");
  return [options](CliContext& context) { return run_serve(*options, context); };
}

}  // namespace gapfarm
