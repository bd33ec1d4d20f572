// gapfarm plan CONFIG|MODEL: what to drive so that a diagnosis sees most.
#include <spdlog/fmt/fmt.h>

#include <nlohmann/json.hpp>

#include "common/json/fields.h"
#include "common/trials/read.h"
#include "common/trials/text/csv.h"
#include "master/cli/diagnosis/plan_drive.h"
#include "master/cli/subcommand.h"
#include "master/diagnose/conclusions/findings.h"
#include "master/experiments/blind_check/cases/sizing.h"

namespace gapfarm {
namespace {

constexpr double kAlike = 0.9;  // |cosine| from which two effects count as alike

constexpr const char* kOfTrials = "a plan of single trials";
constexpr const char* kOfDrive = "a ground robot's drive";
constexpr OptionOf kPlanOptions[] = {
    {"--trials", kOfTrials}, {"--effects", kOfTrials}, {"--sessions", kOfTrials},
    {"--chain", kOfTrials},  {"--levels", kOfTrials},  {"--durations", kOfTrials},
    {"--pool", kOfTrials},   {"--keep", kOfTrials},    {"--seconds", kOfDrive},
    {"--want", kOfDrive},    {"--limit", kOfDrive},
};

constexpr double kLeastFloor_m = 0.1;  // the smallest robots here, and pieces, are as large

// "2", "2x2" or "4x3".
Status read_place(const std::string& text, plan::DriveSettings* place) {
  const auto read = [](std::string_view part, double* value) {
    *value = parse_double(part).value_or(0);
    return *value >= kLeastFloor_m && *value <= 1000;
  };
  const auto sides = parts_of(text, 'x');
  if (sides.size() <= 2 && read(sides.front(), &place->length_m) &&
      read(sides.back(), &place->width_m)) {
    return {};
  }
  return Error{"--place is '" + text +
               "', expected the size of a floor in metres from 0.1 on, such as 2, 2x2 or 4x3"};
}

Status apply_options(PlanOptions& options, Config& config) {
  SimulateSettings& s = config.simulate;
  if (!options.place.empty()) {
    plan::DriveSettings place;
    RETURN_IF_ERROR(read_place(options.place, &place));
    if (place.length_m != place.width_m) {
      return Error{"--place is '" + options.place + "', expected a square, such as 2x2"};
    }
    s.arena_m = place.width_m;
  }
  if (options.sessions) s.sessions = *options.sessions;
  // A piece is put down before every push.
  if (!config.problem.pieces.empty()) s.chain = 1;
  if (options.chain.value_or(s.chain) != s.chain && !config.problem.pieces.empty()) {
    return Error{fmt::format(
        "--chain is {}, but a piece is put down before every push; omit --chain", *options.chain)};
  }
  if (options.chain) s.chain = *options.chain;
  if (!options.levels.empty()) s.levels = options.levels;
  if (!options.durations.empty()) s.durations_s = options.durations;
  if (options.settings.trials < s.sessions * std::max(1U, s.chain)) {
    return Error{
        fmt::format("{} trials are fewer than one chain of {} in each of {} sessions; ask for more "
                    "--trials, or fewer --sessions or a shorter --chain",
                    options.settings.trials, s.chain, s.sessions)};
  }
  std::erase(options.settings.effects, "all");
  RETURN_IF_ERROR(effects_named(config.problem.table(), options.settings.effects));
  return {};
}

std::string size_text(const plan::Visibility& seen) {
  if (!seen.size) return "-";
  return plain_number(*seen.size) + (seen.unit == "-" ? "" : " " + seen.unit);
}

std::string table_text(const plan::DesignedPlan& plan, bool pushes) {
  std::string text = fmt::format("{:<32} {:>14} {:>14}  {}\n", "named 9 times in 10 from", "here",
                                 "random plan", "looks like");
  for (std::size_t k = 0; k < plan.seen.size(); ++k) {
    const plan::Visibility& seen = plan.seen[k];
    text +=
        fmt::format("{:<32} {:>14} {:>14}  {}\n", seen.parameter, size_text(seen),
                    size_text(plan.seen_at_random[k]), seen.likeness >= kAlike ? seen.like : "");
  }
  if (const auto as_good = plan::trials_as_good(plan.power)) {
    text +=
        fmt::format("On average over effects {:.0f} of these trials name what {} random ones do.\n",
                    *as_good, plan.power.back().trials);
  }
  text += fmt::format(
      "No choice of as many such {}, repeats included, shows effects from sizes that are more "
      "than {:.0f} % smaller "
      "(geometric mean).\n",
      pushes ? "pushes" : "chains", std::ceil(100 * (1 - plan.best_share)));
  const auto list = [&](const std::vector<std::string>& names, const std::string& label) {
    if (!names.empty()) text += joined(names) + label + "\n";
  };
  list(plan.not_planned_for, ": do not move where trials end, only how far repeats scatter");
  list(plan.without_shift, ": could not be simulated with this robot");
  text += "Sizes are distances from neutral; -: not within the catalogue's bounds.";
  if (!pushes) {
    text += " What does not show in poses at rest (motor_lag) needs paths: log them too.";
  }
  return text + "\n";
}

constexpr auto kSeen = [](auto& v, auto& row) {
  FIELDS(effect, parameter, unit, size, like, likeness);
};
constexpr auto kPower = [](auto& v, auto& row) { FIELDS(trials, planned, random); };

Json table_json(const plan::DesignedPlan& plan) {
  Json rows = FieldWriter::list(plan.seen, kSeen);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    rows[k]["size_random"] = number_or_null(plan.seen_at_random[k].size);
  }
  return {{"effects", rows},
          {"power", FieldWriter::list(plan.power, kPower)},
          {"best_share", plan.best_share},
          {"not_planned_for", plan.not_planned_for},
          {"without_shift", plan.without_shift}};
}

Result<int> run_plan(PlanOptions& options, const CLI::App& app, CliContext& context) {
  ASSIGN_OR_RETURN(Source source, read_source(options.source));
  const bool of_drive = source.config.problem.ground != nullptr;
  RETURN_IF_ERROR(check_options_of(of_drive ? kOfDrive : kOfTrials, kPlanOptions, app));
  // What a correction would shift is no part of what effects do: it takes none along.
  source.config.problem.residual = {};
  options.outputs.reads(options.source);
  options.outputs.reads(source.config);
  if (of_drive) {
    options.drive.seed = options.settings.seed;
    if (!options.place.empty()) RETURN_IF_ERROR(read_place(options.place, &options.drive));
    return run_plan_drive(options, source.config, context);
  }
  RETURN_IF_ERROR(check_can(source.config.problem.scenario, kSimulates, options.source));
  RETURN_IF_ERROR(apply_options(options, source.config));
  const bool pushes = !source.config.problem.pieces.empty();
  std::vector<std::string> outputs = trial_file_names(options.out, false, pushes);
  outputs.push_back(options.picture);
  RETURN_IF_ERROR(options.outputs.plan(outputs));
  if (context.dry_run) {
    return print_dry_run(fmt::format("plan {} trials for {} into {}", options.settings.trials,
                                     options.source, options.out),
                         {{"out", options.out}, {"trials", options.settings.trials}}, options.farm,
                         source.config.farm, context);
  }
  ASSIGN_OR_RETURN(const auto asked,
                   options.begin("plan", {{"candidates", 10, 0}, {"what they show", 3, 0}},
                                 source.config.farm, context));
  ASSIGN_OR_RETURN(const auto plan, plan::design_plan(*asked, source.config, options.settings,
                                                      context.work->hooks()));
  ASSIGN_OR_RETURN(const auto files,
                   trial_files(shifted(plan.log, source.frame_x_m, source.frame_y_m), options.out));
  for (const TrialFile& file : files) {
    RETURN_IF_ERROR(options.outputs.write(file.path, file.text));
  }
  if (!options.picture.empty()) {
    RETURN_IF_ERROR(
        options.outputs.write(options.picture, plan::plan_picture(source.config.problem, plan)));
  }
  Json json = table_json(plan);
  json["out"] = options.out;
  json["trials"] = plan.log.trials.size();
  context.console.result(
      table_text(plan, pushes) +
          fmt::format("{}: {} {}, in this order; x1, y1, theta1 are where the model says the {} "
                      "stops\n",
                      joined(files, " and ", &TrialFile::path), plan.log.trials.size(),
                      pushes ? "pushes to make" : "trials to drive", pushes ? "piece" : "robot"),
      json);
  return kExitDone;
}

}  // namespace

SubcommandRun setup_plan(CLI::App& app) {
  auto options = std::make_shared<PlanOptions>();
  app.add_option("CONFIG|MODEL", options->source, "The robot as far as it is known")->required();
  app.add_option("--out", options->out,
                 "Trial log (of a ground robot: folder) to write: what to drive")
      ->required();
  app.add_option("--picture", options->picture, "SVG to write: the floor, and power by trials");
  app.add_option("--trials", options->settings.trials, "In all; rounded up to whole chains")
      ->check(CLI::Range(1, 5000));
  app.add_option("--effects", options->settings.effects, "Names with commas between, or all")
      ->delimiter(',');
  app.add_option("--place", options->place, "Floor to stay on, round the start, m: 2x2");
  app.add_option("--sessions", options->sessions, "Sessions")->check(CLI::Range(1, 100));
  app.add_option("--chain", options->chain, "Trials before the robot is put down anew")
      ->check(CLI::Range(1, 1000));
  app.add_option("--levels", options->levels, "Factors of the commands' duties")
      ->check(CLI::Range(0.001, 1.0));
  app.add_option("--durations", options->durations, "s")->check(CLI::Range(0.001, 60.0));
  app.add_option("--pool", options->settings.pool, "Chains to choose each one from")
      ->check(CLI::Range(2, 100));
  app.add_option("--seed", options->settings.seed, "Of the chains to choose from");
  app.add_option("--seconds", options->drive.seconds, "Of a ground robot's drive, at most")
      ->check(CLI::Range(2.0, 3600.0))
      ->capture_default_str();
  app.add_option("--want", options->wanted,
                 "Of a ground robot: a value, and how wide its 90 % interval may be: "
                 "separation=0.5%");
  app.add_option("--limit", options->limits,
                 "Of a ground robot's channel: v=0.5 or throttle=0,0.3");
  options->declare(app, LongOptions::Leaves::kFile, false);
  app.footer(
      "Examples:\n"
      "  gapfarm plan configs/srv1.toml --trials 120 --place 2x2 --out plan.csv\n"
      "  gapfarm plan run/demo/model.toml --effects floor_tilt,motor_asymmetry --out plan.csv "
      "--picture plan.svg");
  return [options, &app](CliContext& context) { return run_plan(*options, app, context); };
}

}  // namespace gapfarm
