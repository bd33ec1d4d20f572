// The model of a run, finished or not.
#pragma once

#include <string>

#include "common/base/result.h"
#include "common/config/config.h"
#include "common/config/model.h"
#include "master/command/console.h"
#include "master/run/stored_run.h"

namespace gapfarm {

// A model file, or the model of a run's or a diagnosis's folder: its model.toml, or, where a run
// has gone further than that says or left none, its best so far, of which a note shows.
Result<Model> read_model_of(const std::string& run_or_model, Console& console);

// An error where the model is one of another scenario or robot than the config's.
Status check_same_robot(const Model& model, const std::string& path, const Config& config,
                        const std::string& config_path);

// An error where the model has a [residual], which `user` ("drive") cannot take along.
Status check_no_residual(const Model& model, const std::string& path, const std::string& user);

}  // namespace gapfarm
