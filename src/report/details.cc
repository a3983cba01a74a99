#include "report/details.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <limits>
#include <map>
#include <optional>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "measures/measure.h"
#include "report/figures/picture.h"
#include "report/replays.h"
#include "report/thumbnail.h"
#include "results/store/pictures.h"
#include "results/store/scene.h"

namespace assay {
namespace {

using nlohmann::json;

// To so many significant digits, so that its text is short.
json rounded(double value, int digits) {
  if (!std::isfinite(value)) return nullptr;
  return std::strtod(fmt::format("{:.{}g}", value, digits).c_str(), nullptr);
}

json rounded(const std::vector<double>& values, int digits) {
  json list = json::array();
  for (const double value : values) list.push_back(rounded(value, digits));
  return list;
}

// ---- samples ------------------------------------------------------------------------------------------------------------

constexpr size_t kFew = 32;
constexpr size_t kBins = 32;
// A few interrupted steps would squeeze all others into one bin: bins end with the last one within so many widths
// of the middle half above it.
constexpr double kWidths = 6;

json one_series(const SampleSeries& series) {
  std::vector<double> values;
  std::ranges::copy_if(series.values, std::back_inserter(values), [](double value) { return std::isfinite(value); });
  json entry = {{"name", series.name}, {"count", values.size()}};
  if (values.size() <= kFew) {
    entry["values"] = rounded(values, 5);
    return entry;
  }
  std::ranges::sort(values);
  const double from = values.front(), lower = values[values.size() / 4], upper = values[values.size() * 3 / 4];
  const double to = *std::prev(std::ranges::upper_bound(values, upper + kWidths * (upper - lower)));
  std::vector<size_t> bins(kBins, 0);
  size_t above = 0;
  for (const double value : values) {
    if (value > to) {
      ++above;
      continue;
    }
    const double place = to > from ? (value - from) / (to - from) * static_cast<double>(kBins) : 0;
    ++bins[std::min(kBins - 1, static_cast<size_t>(place))];
  }
  entry["from"] = rounded(from, 5);
  entry["to"] = rounded(to, 5);
  entry["bins"] = bins;
  entry["above"] = above;
  return entry;
}

// ---- pictures -----------------------------------------------------------------------------------------------------------

json point(const Vec3& p) {
  // a tenth of a millimetre
  const auto coordinate = [](double x) { return std::round(1e4 * x) / 1e4; };
  return {coordinate(p.x()), coordinate(p.y()), coordinate(p.z())};
}

// Terrain is left out: shapes of the world that are longer than all that moves is wide, which would be tiny among them.
json shapes_of(const Scene& scene, const std::vector<Pose>& bodies) {
  const auto place = [&](const Shape& shape) {
    return (shape.body == kWorld ? Pose() : bodies[static_cast<size_t>(shape.body)]) * shape.X_BS;
  };
  Eigen::AlignedBox3d moving;
  for (const Shape& shape : scene.shapes) {
    if (shape.body == kWorld) continue;
    const Rod rod = rod_of(shape, data_of(scene, shape));
    for (const Vec3& end : {rod.a, rod.b}) moving.extend(place(shape) * end);
  }
  json shapes = json::array();
  for (const Shape& shape : scene.shapes) {
    if (is_ground(shape)) continue;
    const Pose X_WS = place(shape);
    const Rod rod = rod_of(shape, data_of(scene, shape));
    if (shape.body == kWorld && !moving.isEmpty() && (rod.b - rod.a).norm() > moving.diagonal().norm()) continue;
    const auto byte = [&](size_t i) {
      return static_cast<int>(std::lround(255 * std::clamp(shape.rgba.at(i), 0.0F, 1.0F)));
    };
    shapes.push_back({{"a", point(X_WS * rod.a)},
                      {"b", point(X_WS * rod.b)},
                      {"r", rounded(rod.radius, 4)},
                      {"c", fmt::format("#{:02x}{:02x}{:02x}", byte(0), byte(1), byte(2))}});
  }
  return shapes;
}

json end_of(const Results& results, const std::string& system, const Scene& scene) {
  const auto end = results.end_of(system);
  if (!end) return nullptr;
  std::vector<Pose> poses;
  poses.reserve(scene.bodies.size());
  for (size_t i = 0; i < scene.bodies.size(); ++i) poses.push_back(scene_pose(scene.bodies[i], end->state.bodies[i]));
  return {{"contender", end->contender}, {"time_s", rounded(end->state.time, 6)}, {"shapes", shapes_of(scene, poses)}};
}

// The capsules of shapes_of() show what consists of capsules and spheres; all else has an image.
json image_of(const SceneRow& row, const Scene& scene, const std::vector<Pose>& poses) {
  const bool is_rods = std::ranges::all_of(scene.shapes, [](const Shape& shape) {
    return is_ground(shape) || shape.type == ShapeType::kCapsule || shape.type == ShapeType::kSphere;
  });
  const json stored = json::parse(row.json);
  const bool has_meshes = stored.contains("pictures");
  if (is_rods && !has_meshes) return nullptr;
  try {
    const Pictures pictures = has_meshes ? parse_pictures(stored["pictures"]) : Pictures();
    const std::string png = thumbnail_png(scene, poses, pictures, figures::azimuth_of(row.system));
    return png.empty() ? json(nullptr) : json("data:image/png;base64," + base64(png));
  } catch (const InputError&) {  // of a stranger's database
    return nullptr;
  }
}

// ---- agreement ----------------------------------------------------------------------------------------------------------

constexpr size_t kMostTimes = 33;
constexpr const char* kDistance = "distance_m ";
constexpr const char* kParting = "parting_time_s ";

// Every so many of `count` samples, so that few enough remain; the last one always does.
std::vector<size_t> kept_times(size_t count) {
  std::vector<size_t> kept;
  if (count == 0) return kept;
  const size_t parts = std::min(count, kMostTimes) - 1;
  for (size_t i = 0; i <= parts; ++i) kept.push_back(parts == 0 ? 0 : i * (count - 1) / parts);
  return kept;
}

struct AgreementOf {
  std::vector<std::string> contenders;
  std::map<std::string, std::vector<SampleSeries>> series;  // by contender
  double timestep_ms = 0;
};

const std::vector<double>* find_series(const std::vector<SampleSeries>& list, const std::string& name) {
  const auto found = std::ranges::find(list, name, &SampleSeries::name);
  return found == list.end() || found->values.empty() ? nullptr : &found->values;
}

json one_agreement(const std::string& system, const AgreementOf& of) {
  const std::vector<double>* time = nullptr;
  for (const auto& [contender, series] : of.series) {
    if (time == nullptr) time = find_series(series, "time_s");
  }
  if (time == nullptr) return nullptr;
  const std::vector<size_t> kept = kept_times(time->size());
  const auto thinned = [&](const std::vector<double>& all) {
    std::vector<double> few;
    few.reserve(kept.size());
    for (const size_t i : kept) few.push_back(i < all.size() ? all[i] : std::numeric_limits<double>::quiet_NaN());
    return few;
  };
  json distances = json::array(), partings = json::array();
  for (size_t i = 0; i < of.contenders.size(); ++i) {
    for (size_t j = i + 1; j < of.contenders.size(); ++j) {
      const std::vector<SampleSeries>& own = of.series.at(of.contenders[i]);
      const auto* distance = find_series(own, kDistance + of.contenders[j]);
      const auto* parting = find_series(own, kParting + of.contenders[j]);
      distances.push_back(distance == nullptr ? json(nullptr) : rounded(thinned(*distance), 3));
      partings.push_back(parting == nullptr ? json(nullptr) : rounded(parting->front(), 5));
    }
  }
  return {{"system", system},
          {"timestep_ms", of.timestep_ms},
          {"contenders", of.contenders},
          {"time_s", rounded(thinned(*time), 6)},
          {"distance_m", std::move(distances)},
          {"parting_s", std::move(partings)}};
}

}  // namespace

json sample_data(const std::vector<SampleSeries>& samples) {
  // "step_time_us" is of version 0.1
  constexpr std::array<std::string_view, 4> kShown = {"window_step_time_us", "step_time_us", "run_time_s",
                                                      "piece_error_m"};
  json list = json::array();
  for (const SampleSeries& series : samples) {
    if (std::ranges::find(kShown, series.name) != kShown.end() && !series.values.empty()) {
      list.push_back(one_series(series));
    }
  }
  return list;
}

json picture_data(const Results& results) {
  // Of a family of sizes the largest stands for all.
  std::map<std::string, std::pair<double, std::string>> largest;
  for (const std::string& system : results.systems()) {
    const std::string family = results.family(system);
    if (!family.empty()) largest[family] = std::max(largest[family], {results.fact(system, "bodies"), system});
  }
  json pictures = json::array();
  for (const SceneRow& row : results.store().scenes()) {
    const auto family = largest.find(results.family(row.system));
    if (family != largest.end() && family->second.second != row.system) continue;
    const Scene& scene = *results.scene(row.system);
    std::vector<Pose> poses;
    poses.reserve(scene.bodies.size());
    for (const SceneBody& body : scene.bodies) poses.push_back(body.X_WB);
    json ground = nullptr;
    for (const Shape& shape : scene.shapes) {
      const bool level = shape.body == kWorld && (shape.X_BS.q * Vec3::UnitZ()).z() > 1 - 1e-9;
      if (is_plane(shape) && level) ground = rounded(shape.X_BS.p.z(), 5);
    }
    pictures.push_back({{"system", row.system},
                        {"image", image_of(row, scene, poses)},
                        {"azimuth", figures::azimuth_of(row.system)},
                        {"start", shapes_of(scene, poses)},
                        {"end", end_of(results, row.system, scene)},
                        {"ground", std::move(ground)}});
  }
  return pictures;
}

json agreement_data(const Results& results) {
  std::vector<std::string> order;
  std::map<std::string, AgreementOf> systems;
  for (const Cell& cell : results.cells()) {
    if (!reads(cell.measure, Reads::kFineRuns) || cell.outcome != Outcome::kOk) continue;
    if (!systems.contains(cell.system)) order.push_back(cell.system);
    AgreementOf& of = systems[cell.system];
    if (of.series.contains(cell.contender)) continue;
    of.contenders.push_back(cell.contender);
    of.series[cell.contender] = results.store().samples(cell.id);
    of.timestep_ms = cell.timestep_ms;
  }
  json list = json::array();
  for (const std::string& system : order) {
    if (json entry = one_agreement(system, systems.at(system)); !entry.is_null()) list.push_back(std::move(entry));
  }
  return list;
}

}  // namespace assay
