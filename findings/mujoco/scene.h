// What the programs of this folder share: a model as text, compiled, with its data.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <string>

#include <mujoco/mujoco.h>

struct Scene {
  mjModel* model = nullptr;
  mjData* data = nullptr;

  explicit Scene(const std::string& text) {
    char error[1000] = "";
    mjSpec* spec = mj_parseXMLString(text.c_str(), nullptr, error, sizeof(error));
    model = spec == nullptr ? nullptr : mj_compile(spec, nullptr);
    if (model == nullptr) {
      std::printf("the model cannot be made: %s\n", error);
      std::exit(2);
    }
    mj_deleteSpec(spec);
    data = mj_makeData(model);
  }
  ~Scene() {
    mj_deleteData(data);
    mj_deleteModel(model);
  }
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  void run(double seconds) const {
    for (const double end = data->time + seconds; data->time < end - model->opt.timestep / 2;) mj_step(model, data);
  }
};
