// How a diagnosis shortens with workers, from the CPU time of its own parts: every simulation runs
// here, one after the other, and is timed; a farm of N workers is then played through, batch by
// batch, each task to whoever is free first, and the master's work in between takes what it took.
//   diagnose_workers configs/srv1.toml log.csv
#include <time.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>

#include "common/config/config.h"
#include "common/problem/problem.h"
#include "common/trials/read.h"
#include "master/diagnose/diagnose.h"
#include "tests/immediate_farm.h"
#include "worker/evaluate.h"

namespace gapfarm {
namespace {

double seconds(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

class TimedFarm : public tests::ImmediateFarm {
 public:
  std::string add_problem(const v1::Problem& problem) override {
    const std::string hash = problem_hash(problem);
    auto prepared = prepare(problem);
    if (prepared) problems_[hash] = std::move(*prepared);
    return hash;
  }

  Status stream(const std::string& hash, std::vector<v1::Task> tasks, const TakeAnswer& take,
                const OnProgress& on_progress) override {
    batches_.emplace_back();
    return ImmediateFarm::stream(hash, std::move(tasks), take, on_progress);
  }

  // CPU time of each task, batch by batch.
  const std::vector<std::vector<double>>& batches() const { return batches_; }

 private:
  Result<v1::TaskResult> answer_task(const std::string& hash, const v1::Task& task) override {
    const double began = seconds(CLOCK_THREAD_CPUTIME_ID);
    v1::TaskResult result = evaluate(problems_.at(hash).get(), task);
    batches_.back().push_back(seconds(CLOCK_THREAD_CPUTIME_ID) - began);
    return result;
  }

  std::map<std::string, std::unique_ptr<PreparedProblem>> problems_;
  std::vector<std::vector<double>> batches_;
};

// Until all batches are done, one after the other, each task given to the first free worker.
double makespan(const std::vector<std::vector<double>>& batches, unsigned workers,
                double round_trip_s) {
  double total = 0;
  for (const std::vector<double>& batch : batches) {
    std::vector<double> free(workers, 0);
    for (double task : batch) *std::min_element(free.begin(), free.end()) += task;
    total += *std::max_element(free.begin(), free.end()) + round_trip_s;
  }
  return total;
}

int run(const std::string& config_path, const std::vector<std::string>& logs, double round_trip) {
  auto config = read_config(config_path);
  if (!config) {
    std::fprintf(stderr, "%s\n", config.error().message.c_str());
    return 2;
  }
  auto log = read_trial_files(logs, command_names(config->problem.commands));
  if (!log) {
    std::fprintf(stderr, "%s\n", log.error().message.c_str());
    return 2;
  }
  config->problem.log = std::move(*log);
  config->problem.genes.clear();
  config->problem.fitness.kind = FitnessKind::kLogScore;
  TimedFarm farm;
  const double began = seconds(CLOCK_THREAD_CPUTIME_ID);
  const auto result = diagnose(farm, config->problem, {});
  const double all = seconds(CLOCK_THREAD_CPUTIME_ID) - began;
  if (!result) {
    std::fprintf(stderr, "%s\n", result.error().message.c_str());
    return 1;
  }
  double simulated = 0;
  std::size_t tasks = 0;
  for (const auto& batch : farm.batches()) {
    for (double t : batch) simulated += t;
    tasks += batch.size();
  }
  std::printf("%s\n", result->diagnosis.headline.c_str());
  std::printf("%zu tasks in %zu batches, %.2f s of workers, %.2f s of the master\n", tasks,
              farm.batches().size(), simulated, all - simulated);
  std::printf("workers   seconds   less than with half as many\n");
  double before = 0;
  for (unsigned workers = 1; workers <= 16; workers *= 2) {
    const double took = all - simulated + makespan(farm.batches(), workers, 1e-3 * round_trip);
    std::printf("%7u   %7.2f   ", workers, took);
    std::printf(before > 0 ? "%.2f\n" : "\n", before / took);
    before = took;
  }
  return 0;
}

}  // namespace
}  // namespace gapfarm

int main(int argc, char** argv) {
  CLI::App app("How long a diagnosis takes with more workers.");
  std::string config;
  std::vector<std::string> logs;
  double round_trip_ms = 1;
  app.add_option("CONFIG", config, "Config file")->required();
  app.add_option("LOG", logs, "Trial logs")->required();
  app.add_option("--round-trip-ms", round_trip_ms, "Of a batch: first task out, last result in");
  CLI11_PARSE(app, argc, argv);
  return gapfarm::run(config, logs, round_trip_ms);
}
