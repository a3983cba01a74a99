// MuJoCo 4.0.1: a light body between the ground and a heavy one sinks in proportion to the ratio of the masses.
//
// Two balls on vertical slides stand on each other on the ground. The softness of the lower contact is set relative to
// the mass that the contact moves alone, which is the light ball's. So the load of the heavy one, r times the light
// one's weight, gives r times its depth, with the same solref and solimp and at every timestep: with the defaults 0.2
// mm for each unit of r.
//
// Ends with status 0 while MuJoCo behaves so, 1 when it does not: then the deviation in engine.cc can go.
#include <cstdio>
#include <string>

#include <mujoco/mujoco.h>

namespace {

// Depth of a ball of 1 kg in the ground under one of `ratio` kg after 2 s, m; negative when the model cannot be made.
double depth(const std::string& ratio, double timestep) {
  const std::string xml = R"(<mujoco><worldbody>
      <geom type="plane" size="1 1 1"/>
      <body pos="0 0 0.1"><joint type="slide" axis="0 0 1"/><geom type="sphere" size="0.1" mass="1"/></body>
      <body pos="0 0 0.3"><joint type="slide" axis="0 0 1"/><geom type="sphere" size="0.1" mass=")" +
                          ratio + R"("/></body>
    </worldbody></mujoco>)";
  char error[1000] = "";
  mjSpec* spec = mj_parseXMLString(xml.c_str(), nullptr, error, sizeof(error));
  if (spec == nullptr) return -1;
  mjModel* model = mj_compile(spec, nullptr);
  mj_deleteSpec(spec);
  if (model == nullptr) return -1;
  model->opt.timestep = timestep;
  mjData* data = mj_makeData(model);
  while (data->time < 2) mj_step(model, data);
  const double result = -data->qpos[0];
  mj_deleteData(data);
  mj_deleteModel(model);
  return result;
}

}  // namespace

int main() {
  bool so = true;
  for (const double timestep : {2e-3, 1.0 / 4e3}) {
    const double equal = depth("1", timestep), ten = depth("10", timestep), hundred = depth("100", timestep);
    std::printf("%.3g ms: 1 kg sinks by %.3f mm under 1 kg, %.3f mm under 10 kg, %.3f mm under 100 kg\n",
                1e3 * timestep, 1e3 * equal, 1e3 * ten, 1e3 * hundred);
    so = so && equal > 0 && hundred / ten > 5 && hundred > 0.01;
  }
  return so ? 0 : 1;
}
