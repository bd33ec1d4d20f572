// gapfarm-worker: evaluates what a master sends.
#include <google/protobuf/text_format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <thread>

#include "common/base/build_info.h"
#include "common/base/clock.h"
#include "common/external/simulator.h"
#include "common/net/keys.h"
#include "common/net/socket.h"
#include "common/process/process_pool.h"
#include "common/usage/usage.h"
#include "worker/evaluate.h"
#include "worker/service.h"

namespace gapfarm {
namespace {

constexpr const char* kExamples = R"(Examples:
  gapfarm-worker --connect tcp://10.0.0.5:5555
      one worker process a core, for the master at that address; they reconnect when it restarts
      (needs keys: `gapfarm keys --help`)
  gapfarm-worker --connect tcp://10.0.0.5:5555 --processes 4 --name rack3
      four processes whose names begin with rack3

  gapfarm-worker --connect tcp://10.0.0.5:5555 --lifetime 3500
      for an hour's allocation: begins no job that it could not finish in time

SIGTERM or Ctrl-C: finish the job in work (--drain: all in hand), then leave.  A second one: leave
at once.
Exit status: 0 stopped as asked or the master's work is done, 2 wrong usage, 69 no master for the
--wait-limit, 78 no master that would have this worker.)";

struct Arguments : ServiceOptions {
  std::vector<std::string> given;  // all of them, as they were
  std::string name;
  unsigned window = 0;
  std::string keys = KeyFolder::default_path();
  bool insecure = false;
  unsigned processes = std::max(1u, std::thread::hardware_concurrency());
  double lifetime_s = 0;
  ProcessLimits limits;
  bool allow_external = false;
  std::string process;  // of one of a supervisor's: its greeting
};

void describe(CLI::App& app, Arguments* arguments) {
  app.footer(kExamples);
  app.set_version_flag("-V,--version", build_summary("gapfarm-worker"));
  add_manual_flag(app, "gapfarm " + build_info().version);
  app.add_option("--connect", arguments->endpoint, "The master: tcp://HOST:PORT or ipc://PATH")
      ->required()
      ->type_name("ENDPOINT");
  app.add_option("--name", arguments->name, "Begin of the workers' names (default: the host's)");
  app.add_option("--keys", arguments->keys,
                 "Folder with worker.key and master.pub, which tcp:// needs (docs/security.md)")
      ->type_name("FOLDER")
      ->capture_default_str();
  app.add_flag("--insecure", arguments->insecure,
               "Talk to a master that has no keys: unencrypted, and to whoever answers");
  app.add_option("--window", arguments->window,
                 "Jobs in hand, the one in work included (default: as the master likes)")
      ->check(CLI::Range(1, 1000));
  app.add_option("--processes", arguments->processes, "Worker processes")
      ->check(CLI::Range(1, 4096))
      ->capture_default_str();
  app.add_flag("--drain", arguments->drain,
               "When asked to stop, finish all jobs in hand instead of only the one in work");
  app.add_option("--lifetime", arguments->lifetime_s,
                 "Be gone after so many seconds, and begin no job that would take longer")
      ->check(CLI::PositiveNumber)
      ->type_name("SECONDS");
  app.add_option("--wait-limit", arguments->wait_limit_s,
                 "Leave when there has been no master for so many seconds (default: wait for ever)")
      ->check(CLI::PositiveNumber)
      ->type_name("SECONDS");
  app.add_option("--progress-limit", arguments->limits.progress_s,
                 "Kill a worker whose simulation makes no step for so many seconds; 0: never")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str()
      ->type_name("SECONDS");
  app.add_option("--answer-limit", arguments->limits.answer_s,
                 "Kill a worker that does not respond at all for so many seconds; 0: never")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str()
      ->type_name("SECONDS");
  app.add_flag("--allow-external", arguments->allow_external,
               "Start the simulators that a master names (docs/external.md): only for one that you "
               "trust with this machine");
  // For the processes that start this one; no user needs them.
  app.add_flag("--local", arguments->local)->group("");
  app.add_flag("--announce", arguments->announce)->group("");
  app.add_option("--process", arguments->process)->group("");
  app.add_option("--deadline", arguments->session.deadline_s)->group("");
  refuse_wrong_values(app);
}

int complain(const Error& error, int status) {
  std::fprintf(stderr, "gapfarm-worker: %s\n", error.message.c_str());
  return status;
}

// A worker that is configured to trust whoever answers may do so anywhere: the endpoint names the
// place.
Result<LinkSecurity> link_security(const Arguments& arguments) {
  LinkSecurity security;
  if (arguments.endpoint.rfind("tcp://", 0) != 0) return security;
  if (!arguments.insecure) return worker_security(arguments.keys);
  security.open = OpenLinks::kAnywhere;
  return security;
}

// One worker, child of a master or a supervisor.
int work(const Arguments& arguments) {
  Result<LinkSecurity> security = link_security(arguments);
  if (!security) return complain(security.error(), kExitRefused);
  StopSource stop;
  // Ctrl-C reaches the whole terminal's group; what it means is the parent's to decide.
  const StopOnSignals signals(&stop, StopOnSignals::kIgnoreInterrupt);
  ServiceOptions options = arguments;
  options.security = std::move(*security);
  v1::Hello& hello = options.session.hello;
  hello.set_name(arguments.name);
  hello.set_host(host_name());
  hello.set_fingerprint(build_info().fingerprint);
  hello.set_numeric_class(numeric_class());
  hello.set_window(arguments.window);
  if (!google::protobuf::TextFormat::MergeFromString(arguments.process, &hello)) {
    return complain({"--process is no greeting"}, kExitUsage);
  }
  const auto page = ProgressPage::inherit();
  if (!page) return complain(page.error(), 1);
  options.progress = &**page;
  // A master on this machine runs what its user may run anyway.
  allow_external_programs(arguments.local || arguments.allow_external);
  EvaluationThread evaluation(options.progress);
  const Result<int> end = serve(options, evaluation, stop);
  const int status = end ? *end : complain(end.error(), kExitRefused);
  // The thread's destructor would wait for a job whose answer nobody wants.
  if (!evaluation.idle()) _exit(status);
  return status;
}

int start_workers(const Arguments& arguments) {
  if (const Status s = check_endpoint(arguments.endpoint); !s) {
    return complain(s.error(), kExitUsage);
  }
  if (const auto security = link_security(arguments); !security) {
    return complain(security.error(), kExitUsage);
  }
  if (arguments.insecure) {
    std::fprintf(stderr, "gapfarm-worker: insecure: working for whoever answers at %s\n",
                 arguments.endpoint.c_str());
  }
  StopSource stop;
  const StopOnSignals signals(&stop);
  const double deadline_s = arguments.session.deadline_s;
  ProcessPoolOptions pool;
  pool.program = executable_path();
  pool.count = arguments.processes;
  pool.name_prefix = unique_worker_name(arguments.name);
  pool.failure_limit = {};
  pool.limits = arguments.limits;
  // The next would not find the time for a job, or a master, as the one before did not.
  pool.replaces_leavers = arguments.wait_limit_s <= 0 && !std::isfinite(deadline_s);
  const Result<int> status = supervise(std::move(pool), arguments.given, deadline_s, stop);
  return status ? *status : complain(status.error(), kExitRefused);
}

}  // namespace
}  // namespace gapfarm

int main(int argc, char** argv) {
  CLI::App app("Evaluates what a gapfarm master sends.", "gapfarm-worker");
  gapfarm::Arguments arguments;
  gapfarm::describe(app, &arguments);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    std::fprintf(stderr, "gapfarm-worker: %s\nSee `gapfarm-worker --help`.\n",
                 gapfarm::usage_sentence(app, error).c_str());
    return gapfarm::kExitUsage;
  }
  arguments.given.assign(argv + 1, argv + argc);
  double& deadline_s = arguments.session.deadline_s;
  if (arguments.lifetime_s > 0 && !std::isfinite(deadline_s)) {
    deadline_s = gapfarm::monotonic_seconds() + arguments.lifetime_s;
  }
  const bool one = arguments.local || !arguments.process.empty();
  return one ? gapfarm::work(arguments) : gapfarm::start_workers(arguments);
}
