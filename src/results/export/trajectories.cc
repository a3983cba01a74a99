#include "results/export/trajectories.h"

#include <cctype>
#include <filesystem>
#include <map>
#include <set>

#include <fmt/format.h>

#include "base/console.h"
#include "base/csv.h"
#include "base/errors.h"
#include "base/exit_status.h"
#include "base/output_file.h"
#include "base/text.h"
#include "results/export/npz.h"
#include "results/store/scene.h"
#include "results/store/state_rows.h"
#include "results/store/store.h"
#include "results/store/trajectory.h"

namespace assay {
namespace {

namespace fs = std::filesystem;

// A name as a file name: other characters become %XX, so that two names never become one file.
std::string file_name(const std::string& name) {
  std::string out;
  for (const char c : name) {
    const bool plain =
        std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_' || (c == '.' && !out.empty());
    out += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return out;
}

void make_folder(const std::string& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw SystemError(fmt::format("cannot make the folder '{}': {}", folder, error.message()));
}

void write_npz(const std::string& path, const RunRow& run, const Trajectory& trajectory, const Scene& scene) {
  const std::vector<State>& states = trajectory.states;
  const size_t samples = states.size(), bodies = scene.bodies.size(), hinges = scene.joints.size();
  std::vector<double> time, position, orientation, velocity, angular_velocity, angle, rate;
  const auto append = [](std::vector<double>& to, std::initializer_list<double> numbers) {
    to.insert(to.end(), numbers);
  };
  for (const State& state : states) {
    time.push_back(state.time);
    for (const BodyState& body : state.bodies) {
      append(position, {body.p_WBcm.x(), body.p_WBcm.y(), body.p_WBcm.z()});
      append(orientation, {body.q_WB.w(), body.q_WB.x(), body.q_WB.y(), body.q_WB.z()});
      append(velocity, {body.v_WBcm.x(), body.v_WBcm.y(), body.v_WBcm.z()});
      append(angular_velocity, {body.w_WB.x(), body.w_WB.y(), body.w_WB.z()});
    }
    angle.insert(angle.end(), state.position.begin(), state.position.end());
    rate.insert(rate.end(), state.velocity.begin(), state.velocity.end());
  }
  std::vector<std::string> names;
  names.reserve(bodies);
  for (const SceneBody& body : scene.bodies) names.push_back(body.name);
  Npz npz;
  npz.add("time", {samples}, time);
  npz.add("position", {samples, bodies, 3}, position);
  npz.add("orientation", {samples, bodies, 4}, orientation);
  npz.add("velocity", {samples, bodies, 3}, velocity);
  npz.add("angular_velocity", {samples, bodies, 3}, angular_velocity);
  npz.add("angle", {samples, hinges}, angle);
  npz.add("rate", {samples, hinges}, rate);
  npz.add("bodies", names);
  npz.add("hinges", scene.joints);
  npz.add("run", {run.system, run.contender});
  npz.add("timestep_ms", {}, {run.timestep_ms});
  npz.write(path);
}

void write_csv(const std::string& path, const Trajectory& trajectory, const Scene& scene) {
  std::vector<std::string> names;
  names.reserve(scene.bodies.size());
  for (const SceneBody& body : scene.bodies) names.push_back(csv_field(body.name));
  OutputFile file(path);
  file.write(kStateHeader);
  fmt::memory_buffer text;
  for (const State& state : trajectory.states) {
    text.clear();
    append_state_rows(names, state.time, state, text);
    file.write({text.data(), text.size()});
  }
  file.finish();
}

}  // namespace

int export_trajectories(const std::string& dir, const std::string& format, const std::string& folder) {
  if (format != "npz" && format != "csv")
    throw InputError(fmt::format("--trajectories is '{}': use npz or csv", format));
  const Store store = Store::open(dir);
  const std::vector<RunRow> runs = store.runs();
  if (runs.empty()) {
    throw InputError(
        fmt::format("'{}' lists no kept runs: either no measure of its campaign keeps runs, or an older assay "
                    "made it; in that case run the command that made it again",
                    dir));
  }
  std::map<std::string, Scene> scenes;
  for (const SceneRow& row : store.scenes()) scenes[row.system] = parse_scene(row.json);
  make_folder(folder);
  std::string index = "file,system,contender,timestep_ms,samples,bodies\n";
  std::set<std::string> taken;
  size_t written = 0, damaged = 0;
  for (const RunRow& run : runs) {
    const auto scene = scenes.find(run.system);
    if (scene == scenes.end() || !has_trajectory(store.trajectories_dir(), run.address)) continue;
    const auto trajectory = read_trajectory(store.trajectories_dir(), run.address);
    const std::string fault = trajectory
                                  ? run_fault(*trajectory, scene->second.bodies.size(), scene->second.joints.size())
                                  : trajectory_fault(store.trajectories_dir(), run.address);
    if (!trajectory || !fault.empty()) {
      ++damaged;
      message(fmt::format("'{}' {}: the run of {} on {} at {} ms is left out",
                          trajectory_path(store.trajectories_dir(), run.address), fault, run.contender, run.system,
                          timestep_label(run.timestep_ms)));
      continue;
    }
    make_folder(fmt::format("{}/{}", folder, file_name(run.system)));
    std::string file = fmt::format("{}/{}", file_name(run.system), file_name(run.contender));
    // The reference run comes first; names of runs at other timesteps hold the timestep.
    if (!taken.insert(file).second) file += fmt::format("-{}ms", shortest(run.timestep_ms));
    file += fmt::format(".{}", format);
    const std::string path = fmt::format("{}/{}", folder, file);
    if (format == "npz") {
      write_npz(path, run, *trajectory, scene->second);
    } else {
      write_csv(path, *trajectory, scene->second);
    }
    index += fmt::format("{},{},{},{},{},{}\n", csv_field(file), csv_field(run.system), csv_field(run.contender),
                         shortest(run.timestep_ms), trajectory->states.size(), scene->second.bodies.size());
    ++written;
  }
  OutputFile file(folder + "/index.csv");
  file.write(index);
  file.finish();
  const size_t missing = runs.size() - written - damaged;
  std::string rest = missing == 0 ? "" : fmt::format("; {} failed or not measured yet", counted(missing, "run"));
  if (damaged > 0) {
    rest += fmt::format("; {} damaged: the command that measured them makes them again", counted(damaged, "run"));
  }
  message(fmt::format("{} written to '{}'{}", counted(written, "run"), folder, rest));
  return damaged == 0 ? exits::kDone : exits::kFailed;
}

}  // namespace assay
