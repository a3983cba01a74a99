#include "run/coordinator/run_probe.h"

#include <algorithm>
#include <functional>
#include <iterator>

#include <fmt/format.h>

#include "base/text.h"
#include "run/coordinator/subject.h"

namespace assay {

void probe_speeds(RunShared& run, const Work& work, Speeds& speeds) {
  std::set<std::pair<int, int>> wanted;
  for (const PlannedCell* cell : work.todo) {
    if (cell->steps > 0 && work.is_scored(run.contender(*cell))) wanted.insert({cell->system, cell->contender});
  }
  std::map<std::pair<std::string, int>, std::vector<int>> families;  // systems by family and contender
  for (const auto& [s, c] : wanted) {
    const std::string& family = run.system(s).family;
    if (!family.empty()) families[{family, c}].push_back(s);
  }
  const auto size = [&](int s) { return run.system(s).model.bodies.size(); };
  for (auto& [name, systems] : families) {
    std::ranges::stable_sort(systems, {}, size);
    for (size_t i = 1; i + 1 < systems.size(); ++i) {
      if (i != systems.size() / 2) wanted.erase({systems[i], name.second});
    }
  }
  // Of each contender the smallest system, the largest, and then the others, as long as its probes have taken little
  // time: an engine that needs seconds to start would take longer to probe than to measure.
  constexpr double kContenderSeconds = 10, kStartSeconds = 60;
  struct Queue {
    std::vector<int> systems;
    size_t begun = 0;
    double spent_s = 0;
  };
  std::map<int, Queue> queues;
  for (const auto& [s, c] : wanted) queues[c].systems.push_back(s);
  if (!queues.empty()) {
    run.progress.phase(
        fmt::format("a look at the speed of {}, for the estimate of the time", counted(queues.size(), "contender")));
  }
  Pool pool(run.program, run.jobs, run.interrupts);
  const std::function<void(int)> add_next = [&](int c) {
    Queue& queue = queues.at(c);
    if (queue.begun == queue.systems.size() || queue.spent_s > kContenderSeconds) return;
    const int s = queue.systems[queue.begun++];
    const CampaignSystem& probed = run.system(s);
    Job job;
    job.request = ProbeJob{subject_spec(probed, run.contender(c)), probed.timesteps_ms.front(), !probed.family.empty()};
    job.limit_s = kStartSeconds;
    job.on_end = [&speeds, &add_next, &queue, at = std::pair(s, c)](const JobEnd& end) {
      if (end.answer) {
        speeds.step_us[at] = end.answer->step_us;
        speeds.starts.instance_s[at] = end.answer->instance_s;
        if (end.answer->start_s > 0) speeds.starts.worker_s.emplace(at.second, end.answer->start_s);
      }
      queue.spent_s += end.wall_s;
      add_next(at.second);
    };
    pool.add(std::move(job));
  };
  for (auto& [c, queue] : queues) {
    std::ranges::stable_sort(queue.systems, {}, size);
    if (queue.systems.size() > 2) std::rotate(queue.systems.begin() + 1, queue.systems.end() - 1, queue.systems.end());
    add_next(c);
  }
  pool.run({});
  // Systems without a time, also those whose probe took too long. The probe of an engine that fails has answered 0.
  // What an instance takes grows with its meshes: two robots of equally many bodies may differ a thousandfold.
  const auto size_of_instance = [&](int s) {
    const Model& model = run.system(s).model;
    size_t vertices = 0;
    for (const Hull& hull : model.hulls) vertices += hull.vertices.size();
    return static_cast<double>(model.bodies.size() + vertices);
  };
  const auto interpolate_one = [&](std::map<std::pair<int, int>, double>& times, const std::vector<int>& systems, int c,
                                   const std::function<double(int)>& size_of) {
    std::map<double, double> known;
    for (const int s : systems) {
      const auto found = times.find({s, c});
      if (found != times.end() && found->second > 0) known[size_of(s)] = found->second;
    }
    if (known.empty()) return;
    for (const int s : systems) times.try_emplace({s, c}, time_at_size(known, size_of(s)));
  };
  const auto interpolate = [&](const std::vector<int>& systems, int c) {
    interpolate_one(speeds.step_us, systems, c, [&](int s) { return static_cast<double>(size(s)); });
    interpolate_one(speeds.starts.instance_s, systems, c, size_of_instance);
  };
  for (const auto& [name, systems] : families) interpolate(systems, name.second);
  for (const auto& [c, queue] : queues) {
    // A step with contacts costs another multiple of the bodies than one without.
    for (const bool contacts : {false, true}) {
      std::vector<int> alike;
      std::ranges::copy_if(queue.systems, std::back_inserter(alike),
                           [&](int s) { return run.system(s).model.contacts.empty() != contacts; });
      interpolate(alike, c);
    }
    interpolate(queue.systems, c);
  }
}

}  // namespace assay
