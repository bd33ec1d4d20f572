// Farms of echoing workers for benchmarks.
#pragma once

#include <stdlib.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/process/process_pool.h"
#include "master/farm/socket_farm.h"

namespace gapfarm {

inline const char* const kWorkerProgram = GAPFARM_BIN_DIR "/gapfarm-fake-worker";

enum Link { kIpc, kTcp, kCurve };

inline std::vector<v1::Task> echo_tasks(std::size_t count, std::uint64_t busy_us,
                                        std::size_t bytes) {
  std::vector<v1::Task> tasks(count);
  for (v1::Task& task : tasks) {
    task.mutable_echo()->set_payload(std::string(bytes, 'x'));
    task.mutable_echo()->set_busy_us(busy_us);
  }
  return tasks;
}

// Keys of a master and its workers, gone with their owner.
class BenchKeys {
 public:
  BenchKeys() {
    std::string pattern = (std::filesystem::temp_directory_path() / "gapfarm-keys-XXXXXX").string();
    path_ = mkdtemp(pattern.data());
    const auto folder = KeyFolder::open(path_);
    const KeyPair worker = make_key_pair("worker");
    const bool made = folder && folder->add_pair("master", make_key_pair("master")) &&
                      folder->add_pair("worker", worker) &&
                      folder->list({"worker", worker.public_key});
    if (!made) std::fprintf(stderr, "no keys\n");
  }
  ~BenchKeys() { std::filesystem::remove_all(path_); }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

// A farm whose workers have all answered.
struct Bench {
  Bench(Link link, unsigned workers) {
    SocketFarmOptions options;
    options.worker_program = kWorkerProgram;
    options.on_event = [](const FarmEvent&) {};
    if (link == kIpc) {
      options.local_workers = workers;
    } else {
      options.listen = {"tcp://127.0.0.1:*"};
      options.security.open = OpenLinks::kLoopback;
      if (link == kCurve) options.security = master_security(keys.path()).value();
    }
    farm = std::move(SocketFarm::create(options)).value();
    if (link != kIpc) start_remote(link, workers);
    while (farm->workers().size() < workers) run(echo_tasks(2 * workers, 1000, 0));
  }

  void start_remote(Link link, unsigned workers) {
    ProcessPoolOptions options;
    options.program = "/usr/bin/setpriv";  // the workers go when the benchmark is killed
    std::vector<std::string> arguments = {
        "--pdeathsig",           "KILL",        kWorkerProgram,         "--connect",
        farm->endpoints().at(0), "--processes", std::to_string(workers)};
    if (link == kTcp) arguments.push_back("--insecure");
    if (link == kCurve) arguments.insert(arguments.end(), {"--keys", keys.path()});
    options.arguments = [arguments](const std::string&, const ProcessEnded*) { return arguments; };
    remote = std::make_unique<ProcessPool>(std::move(options));
    if (!remote->start(monotonic_seconds())) std::fprintf(stderr, "no workers\n");
  }

  void run(const std::vector<v1::Task>& tasks) {
    if (!farm->run("", tasks)) std::fprintf(stderr, "a run failed\n");
  }

  BenchKeys keys;
  std::unique_ptr<ProcessPool> remote;
  std::unique_ptr<SocketFarm> farm;
};

}  // namespace gapfarm
