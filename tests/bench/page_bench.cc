// What a run's page costs: a run of many evaluations is made up, and asked for as a browser would.
//   bench_page [GENERATIONS POPULATION [CONFIG]]
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "master/command/inputs.h"
#include "master/run/run_page.h"
#include "master/serve/site.h"
#include "master/store/run_lock.h"
#include "master/store/run_store.h"

namespace gapfarm {
namespace {

namespace fs = std::filesystem;

double bench_now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// In [0, 1), the same every time.
double mixed(std::uint64_t i) {
  i = (i + 0x9e3779b97f4a7c15u) * 0xbf58476d1ce4e5b9u;
  i = (i ^ (i >> 27)) * 0x94d049bb133111ebu;
  return static_cast<double>(i >> 11) / 9007199254740992.0;
}

RunInfo made_up_info(const Config& config) {
  const v1::Problem problem = to_proto(config.problem);
  RunInfo info;
  info.config_path = config.path;
  info.config_text = config.text;
  info.problem = serialise(problem);
  info.problem_hash = problem_hash(problem);
  info.seed = config.seed;
  info.fitness = fitness_name(config.problem.fitness.kind);
  info.fitness_unit = fitness_unit(config.problem.fitness.kind);
  info.higher_is_better = higher_is_better(config.problem.fitness.kind);
  return info;
}

StoredGeneration made_up_generation(const Problem& problem, std::uint64_t number,
                                    std::size_t population) {
  StoredGeneration g;
  g.generation = number;
  g.evaluations = number * population;
  g.wall_s = 1;
  for (const char* name : {"blend", "gaussian", "uniform", "de_rand", "restart", "swap"}) {
    g.operator_probabilities.emplace_back(name, mixed(number));
  }
  for (std::size_t i = 0; i < population; ++i) {
    StoredIndividual one;
    one.birth_id = number * population + i;
    for (std::size_t k = 0; k < problem.genes.size(); ++k) {
      one.genome.push_back(mixed(one.birth_id * 64 + k));
    }
    one.values = readable_values(problem, one.genome);
    one.fitness = -5 - static_cast<double>(i) - 100.0 / static_cast<double>(number);
    one.scores = 1;
    one.parents = {1, 2};
    one.operators = "blend+gaussian";
    g.individuals.push_back(std::move(one));
  }
  g.optimiser_state.assign(24 * population * problem.genes.size(), 's');
  summarise_fitness(g, true);
  return g;
}

Status make_up(const fs::path& run, const Config& config, std::uint64_t generations,
               std::size_t population) {
  auto store = RunStore::create(run, made_up_info(config));
  if (!store) return store.error();
  for (std::uint64_t g = 1; g <= generations; ++g) {
    const auto digest = store->commit(made_up_generation(config.problem, g, population));
    if (!digest) return digest.error();
  }
  const RunOutcome outcome = run_outcome(config.problem, nullptr, nullptr, {});
  if (Status s = store->keep_document(kOutcomeDocument, to_json(outcome)); !s) return s;
  Progress end;
  end.state = RunState::kFinished;
  return store->set_progress(end);
}

int measure(const fs::path& folder) {
  SiteSources sources;
  sources.folders = {folder};
  sources.unix_now_s = unix_now_s;
  sources.cpu_now_s = bench_now_s;
  sources.read_run = read_run_report;
  sources.drive = [](const DriveQuestion&) -> Result<std::string> { return Error{"none"}; };
  Site site(std::move(sources));
  const std::string view = "/view?of=" + percent_encoded((folder / "run").string());
  const auto ask = [&](const char* what, const std::string& target, const std::string& known) {
    const double began_s = bench_now_s();
    HttpResponse response = site.answer({"GET", target, "localhost", known});
    std::printf("%-28s %3u %8.1f ms %9.3f MB\n", what, response.status,
                1e3 * (bench_now_s() - began_s), 1e-6 * static_cast<double>(response.body.size()));
    return response;
  };
  ask("the list", "/", "");
  const HttpResponse page = ask("the run's page", view, "");
  ask("again, for somebody else", view, "");
  ask("again, unchanged", view, page.etag);
  ask("one of its genomes", view + "&genome=4321", "");
  ask("beside itself", "/compare?" + view.substr(6) + "&" + view.substr(6), "");
  return page.status == 200 ? 0 : 1;
}

int run_bench(int argc, char** argv) {
  const std::uint64_t generations = argc > 2 ? std::strtoull(argv[1], nullptr, 10) : 2500;
  const std::size_t population = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 40;
  const std::string path = argc > 3 ? argv[3] : GAPFARM_SOURCE_DIR "/configs/demo.toml";
  const auto config = read_config_and_trials(path, TrialOptions{});
  if (!config) {
    std::fprintf(stderr, "%s\n", config.error().message.c_str());
    return 2;
  }
  std::string pattern = (fs::temp_directory_path() / "gapfarm-page-XXXXXX").string();
  const fs::path folder = ::mkdtemp(pattern.data());
  std::printf("%llu generations of %zu, %zu genes, %zu trials: %llu evaluations\n",
              static_cast<unsigned long long>(generations), population,
              config->problem.genes.size(), config->problem.log.trials.size(),
              static_cast<unsigned long long>(generations * population));
  const Status made = make_up(folder / "run", *config, generations, population);
  if (!made) std::fprintf(stderr, "%s\n", made.error().message.c_str());
  const int code = made ? measure(folder) : 1;
  fs::remove_all(folder);
  return code;
}

}  // namespace
}  // namespace gapfarm

int main(int argc, char** argv) { return gapfarm::run_bench(argc, argv); }
