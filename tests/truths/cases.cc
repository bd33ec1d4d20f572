#include "tests/truths/cases.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "common/json/json.h"
#include "common/trials/files.h"
#include "common/trials/read.h"

namespace gapfarm::truths {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kClear = 5, kSubtle = 1.6;
constexpr unsigned kSizedOf = 3;  // one chain in so many measures a size

double around(double middle, double spread, Stream& stream) {
  return middle * std::pow(spread, stream.uniform(-1, 1));
}

std::uint64_t seed_of(std::uint64_t seed, std::uint64_t number) {
  return Stream({seed, Purpose::kTest, number}).bits() >> 11;
}

std::vector<PlannedDrive> thinned(const std::vector<PlannedDrive>& plan, unsigned chain) {
  std::vector<PlannedDrive> some;
  for (const PlannedDrive& drive : plan) {
    if (drive.trial / chain % kSizedOf == 0) some.push_back(drive);
  }
  return some;
}

// Effects to take in turn.
std::vector<const EffectRow*> rows_of(const EngineKind& engine, const CaseSettings& settings,
                                      bool in_catalogue) {
  const auto has = [](const std::vector<std::string>& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  std::vector<const EffectRow*> rows;
  for (const EffectRow& row : effect_rows()) {
    if (row.in_catalogue != in_catalogue || has(engine.cannot, row.name)) continue;
    if (settings.effects.empty() || has(settings.effects, row.name)) rows.push_back(&row);
  }
  return rows;
}

class Maker {
 public:
  Maker(const EngineKind& engine, const CaseSettings& settings)
      : engine_(engine), settings_(settings) {}

  Result<Made> make() {
    const CaseCounts& counts = settings_.counts;
    for (unsigned i = 0; i < counts.nulls; ++i) {
      if (Status s = add(nullptr, "", 1); !s) return s.error();
    }
    struct Kind {
      unsigned count;
      bool in_catalogue;
      const char* level;
      double size;
    };
    for (const Kind& kind :
         {Kind{counts.clear, true, "clear", kClear}, Kind{counts.subtle, true, "subtle", kSubtle},
          Kind{counts.outside, false, "clear", kClear}}) {
      const auto rows = rows_of(engine_, settings_, kind.in_catalogue);
      if (kind.count > 0 && rows.empty()) return Error{"no such effect in this engine"};
      for (unsigned i = 0; i < kind.count; ++i) {
        if (Status s = add(rows[i % rows.size()], kind.level, kind.size); !s) return s.error();
      }
    }
    return made_;
  }

 private:
  Status add(const EffectRow* row, const char* level, double wanted) {
    Case next;
    next.seed = seed_of(settings_.seed, number_++);
    next.level = level;
    draw_robot(next.seed, next);
    const std::vector<PlannedDrive> plan = draw_plan(settings_.plan, next.seed);
    if (row != nullptr) {
      const Baseline baseline(engine_, next.robot, thinned(plan, settings_.plan.chain), next.noise);
      Sized sized = sized_cause(baseline, *row, wanted, settings_.plan.arena_m, next.seed);
      if (!sized.reached) {
        made_.out_of_reach.push_back(row->name);
        return {};
      }
      next.size = sized.size;
      next.causes.push_back(std::move(sized.cause));
    }
    const TrialLog log = drive_log(engine_, next.robot, plan, next.causes, next.noise, next.seed);
    char id[32];
    std::snprintf(id, sizeof id, "case%03u", ++made_.cases);
    if (Status s = write_trials(log, settings_.out + "/cases/" + id + "/trials.csv"); !s) return s;
    return write_file_atomically(settings_.out + "/truth/" + id + ".json", truth_text(next));
  }

  const EngineKind& engine_;
  const CaseSettings& settings_;
  std::uint64_t number_ = 0;
  Made made_;
};

}  // namespace

void draw_robot(std::uint64_t seed, Case& made) {
  Stream stream({seed, Purpose::kTest, ~1ull});
  Robot& r = made.robot;
  r.mass_kg = around(0.35, 1.25, stream);
  r.length_m = around(0.1, 1.1, stream);
  r.gauge_m = around(0.085, 1.08, stream);
  r.friction = around(0.6, 1.3, stream);
  r.friction_ratio = around(1, 1.15, stream);
  r.full_speed_m_s = around(0.28, 1.12, stream);
  r.lag_s = around(0.012, 1.6, stream);
  r.shear_m = around(0.0006, 2, stream);
  made.noise = {around(0.012, 1.2, stream), around(0.01, 1.2, stream), around(0.0015, 1.2, stream),
                around(0.008, 1.2, stream)};
}

std::string truth_text(const Case& made) {
  Json effects = Json::object(), sizes = Json::object();
  bool outside = false;
  for (const Cause& cause : made.causes) {
    effects[cause.row->name] = cause.values;
    sizes[cause.row->name] = made.size;
    outside = outside || !cause.row->in_catalogue;
  }
  const Robot& r = made.robot;
  const Json json = {{"effects", effects},
                     {"size", sizes},
                     {"level", made.level},
                     {"robot",
                      {{"mass", r.mass_kg},
                       {"gauge", r.gauge_m},
                       {"length", r.length_m},
                       {"friction", r.friction},
                       {"friction_ratio", r.friction_ratio},
                       {"full_speed", r.full_speed_m_s},
                       {"lag", r.lag_s},
                       {"shear", r.shear_m},
                       {"drive_noise_common", made.noise.common},
                       {"drive_noise_side", made.noise.side},
                       {"pose_noise_position", made.noise.position_m},
                       {"pose_noise_heading", made.noise.heading_rad}}},
                     {"seed", made.seed},
                     {"answer", outside               ? "unknown"
                                : made.causes.empty() ? "none"
                                                      : "effect"}};
  return json_text(json, 1) + "\n";
}

Result<Made> make_cases(const EngineKind& engine, const CaseSettings& settings) {
  return Maker(engine, settings).make();
}

}  // namespace gapfarm::truths
