// MuJoCo models of texts.
#pragma once

#include <mujoco/mujoco.h>

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>

namespace gapfarm::truths {

struct DeleteModel {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
};
struct DeleteData {
  void operator()(mjData* data) const { mj_deleteData(data); }
};

using ModelPointer = std::unique_ptr<mjModel, DeleteModel>;
using DataPointer = std::unique_ptr<mjData, DeleteData>;

template <class... Values>
std::string text_of(const char* format, Values... values) {
  char text[900];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

// MuJoCo reads models from files; this one lies in its own memory.
inline ModelPointer load_model(const std::string& xml) {
  auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  mj_makeEmptyFileVFS(files.get(), "robot.xml", static_cast<int>(xml.size()));
  xml.copy(static_cast<char*>(files->filedata[0]), xml.size());
  char error[500] = "";
  mjModel* model = mj_loadXML("robot.xml", files.get(), error, sizeof error);
  mj_deleteVFS(files.get());
  if (model == nullptr) {
    std::fprintf(stderr, "MuJoCo does not take the robot: %s\n", error);
    std::abort();
  }
  return ModelPointer(model);
}

}  // namespace gapfarm::truths
