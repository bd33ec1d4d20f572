// gapfarm-worker: evaluates what a master sends.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
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
  std::string keys = KeyFolder::default_path();
  bool insecure = false;
  unsigned processes = std::max(1u, std::thread::hardware_concurrency());
  double lifetime_s = 0;
  ProcessLimits limits;
  bool allow_external = false;
  bool process = false;  // one of a supervisor's
};

void describe(CLI::App& app, Arguments* arguments) {
  app.footer(kExamples);
  app.set_version_flag("-V,--version", build_summary("gapfarm-worker"));
  add_manual_flag(app, "gapfarm " + build_info().version);
  app.add_option("--connect", arguments->endpoint, "The master: tcp://HOST:PORT or ipc://PATH")
      ->required()
      ->type_name("ENDPOINT");
  app.add_option("--name", arguments->session.name,
                 "Begin of the workers' names (default: the host's)");
  app.add_option("--keys", arguments->keys,
                 "Folder with worker.key and master.pub, which tcp:// needs (docs/security.md)")
      ->type_name("FOLDER")
      ->capture_default_str();
  app.add_flag("--insecure", arguments->insecure,
               "Talk to a master that has no keys: unencrypted, and to whoever answers");
  app.add_option("--window", arguments->session.window,
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
  app.add_flag("--process", arguments->process)->group("");
  app.add_option("--replaces", arguments->session.replaces)->group("");
  app.add_option("--replaced-end", arguments->session.replaced_end)
      ->check(CLI::Range(0, static_cast<int>(EndCause::kStuck)))
      ->group("");
  app.add_option("--replaced-epoch", arguments->session.replaced_epoch)->group("");
  app.add_option("--replaced-attempt", arguments->session.replaced_attempt)->group("");
  app.add_option("--replaced-failure", arguments->session.replaced_failure)->group("");
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
  options.session.host = host_name();
  options.session.fingerprint = build_info().fingerprint;
  options.session.numeric_class = numeric_class();
  if (arguments.lifetime_s > 0) {
    options.session.deadline_s = monotonic_seconds() + arguments.lifetime_s;
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
  SupervisorOptions options;
  options.program = executable_path();
  options.name = unique_worker_name(arguments.session.name);
  options.processes = arguments.processes;
  options.arguments = {"--connect", arguments.endpoint, "--keys", arguments.keys};
  if (arguments.insecure) options.arguments.push_back("--insecure");
  if (arguments.session.window > 0) {
    options.arguments.insert(options.arguments.end(),
                             {"--window", std::to_string(arguments.session.window)});
  }
  if (arguments.drain) options.arguments.push_back("--drain");
  if (arguments.allow_external) options.arguments.push_back("--allow-external");
  options.limits = arguments.limits;
  if (arguments.wait_limit_s > 0) {
    options.leaves_for_good = true;
    options.arguments.insert(options.arguments.end(),
                             {"--wait-limit", std::to_string(arguments.wait_limit_s)});
  }
  if (arguments.lifetime_s > 0) options.deadline_s = monotonic_seconds() + arguments.lifetime_s;
  const Result<int> status = supervise(options, stop);
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
  const bool one = arguments.local || arguments.process;
  return one ? gapfarm::work(arguments) : gapfarm::start_workers(arguments);
}
