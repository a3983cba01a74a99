#include "report/replays.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <zlib.h>

#include "base/errors.h"
#include "base/json.h"
#include "base/text.h"
#include "results/line_up.h"
#include "results/store/facts.h"
#include "results/store/pictures.h"
#include "results/store/store.h"
#include "results/store/trajectory.h"

namespace assay {
namespace {

using nlohmann::json;

constexpr size_t kColumns = 7;  // of a body: position, quaternion

void put_number(std::string& out, std::int64_t number) {
  // zigzag: small numbers of both signs are small
  auto bits = (static_cast<std::uint64_t>(number) << 1) ^ static_cast<std::uint64_t>(number >> 63);
  for (; bits >= 0x80; bits >>= 7) out += static_cast<char>(0x80 | (bits & 0x7f));
  out += static_cast<char>(bits);
}

std::string deflated(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string out(size, '\0');
  // NOLINTNEXTLINE(*-reinterpret-cast): zlib's bytes are unsigned
  const int code = compress2(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
                             bytes.size(), Z_BEST_COMPRESSION);
  if (code != Z_OK) throw SystemError(fmt::format("cannot pack {} bytes of a replay: {}", bytes.size(), zError(code)));
  out.resize(size);
  return out;
}

struct Packed {
  std::string data;
  size_t frames = 0;
  double position_error_m = 0, rotation_error_rad = 0;
};

Packed pack(const std::vector<State>& states, size_t stride, const ReplayOptions& options) {
  Packed packed;
  packed.frames = (states.size() - 1) / stride + 1;
  const size_t bodies = states.front().bodies.size();
  std::string numbers;
  std::array<std::vector<std::int64_t>, kColumns> columns;
  for (size_t body = 0; body < bodies; ++body) {
    for (auto& column : columns) column.clear();
    Eigen::Vector4d before = Eigen::Vector4d::Zero();
    for (size_t frame = 0; frame < packed.frames; ++frame) {
      const BodyState& state = states[frame * stride].bodies[body];
      Eigen::Vector4d q(state.q_WB.w(), state.q_WB.x(), state.q_WB.y(), state.q_WB.z());
      if (q.dot(before) < 0) q = -q;
      before = q;
      Vec3 p;
      Eigen::Vector4d r;
      for (size_t i = 0; i < kColumns; ++i) {
        const bool place = i < 3;
        const double value = place ? state.p_WBcm[static_cast<Eigen::Index>(i)] : q[static_cast<Eigen::Index>(i) - 3];
        const double step = place ? options.position_step_m : options.rotation_step;
        const std::int64_t whole = std::llround(value / step);
        columns.at(i).push_back(whole);
        const double back = static_cast<double>(whole) * step;
        if (place) {
          p[static_cast<Eigen::Index>(i)] = back;
        } else {
          r[static_cast<Eigen::Index>(i) - 3] = back;
        }
      }
      packed.position_error_m = std::max(packed.position_error_m, (p - state.p_WBcm).norm());
      // by the chord, which small angles do not round away
      const double chord = (r.normalized() - q.normalized()).norm();
      packed.rotation_error_rad = std::max(packed.rotation_error_rad, 4 * std::asin(std::min(1.0, chord / 2)));
    }
    for (const auto& column : columns) {
      std::int64_t last = 0, change = 0;
      for (const std::int64_t number : column) {
        put_number(numbers, number - last - change);
        change = number - last;
        last = number;
      }
    }
  }
  packed.data = base64(deflated(numbers));
  return packed;
}

// Mean distance of the bodies from the same frame of `reference`, with three digits, as long as both go on.
json distances(const std::vector<State>& states, const std::vector<State>& reference, size_t stride) {
  json out = json::array();
  for (size_t i = 0; i < std::min(states.size(), reference.size()); i += stride) {
    double sum = 0;
    for (size_t body = 0; body < states[i].bodies.size(); ++body) {
      sum += (states[i].bodies[body].p_WBcm - reference[i].bodies[body].p_WBcm).norm();
    }
    const double mean = sum / static_cast<double>(states[i].bodies.size());
    out.push_back(std::stod(fmt::format("{:.3g}", mean)));
  }
  return out;
}

// Runs of the system that the page is to have: first the references in the line-up's order, then those of each other
// timestep.
std::vector<ReplayRun> kept_runs(const Store& store, const std::string& system, size_t bodies, size_t most,
                                 const std::string& trained_in) {
  std::vector<RunRow> rows;
  std::vector<std::string> names;
  for (const RunRow& row : store.runs()) {
    if (row.system != system || !has_trajectory(store.trajectories_dir(), row.address)) continue;
    if (std::ranges::find(names, row.contender) == names.end()) names.push_back(row.contender);
    rows.push_back(row);
  }
  const bool trained = std::ranges::find(names, trained_in) != names.end();
  names = line_up(names, most);
  if (trained && std::ranges::find(names, trained_in) == names.end()) names.back() = trained_in;
  const auto place = [&](const RunRow& row) { return std::ranges::find(names, row.contender) - names.begin(); };
  std::erase_if(rows, [&](const RunRow& row) { return place(row) == std::ssize(names); });
  std::ranges::sort(rows, [&](const RunRow& a, const RunRow& b) {
    return std::pair(a.timestep_ms, place(a)) < std::pair(b.timestep_ms, place(b));
  });
  std::vector<ReplayRun> kept;
  for (const RunRow& row : rows) {
    auto trajectory = read_run(store.trajectories_dir(), row.address, bodies);
    // A single state is no run, and a damaged file is computed again by the campaign's next start.
    if (!trajectory || trajectory->states.size() < 2) continue;
    kept.push_back({row.contender, row.timestep_ms, std::move(trajectory->states)});
  }
  // Fine-step runs may have more samples than the others.
  const auto spacing = [](const ReplayRun& run) { return run.states[1].time - run.states[0].time; };
  double coarsest = 0;
  for (const ReplayRun& run : kept) coarsest = std::max(coarsest, spacing(run));
  for (ReplayRun& run : kept) {
    const auto stride = static_cast<size_t>(std::max(1.0, std::round(coarsest / spacing(run))));
    if (stride == 1) continue;
    std::vector<State> fewer;
    for (size_t i = 0; i < run.states.size(); i += stride) fewer.push_back(std::move(run.states[i]));
    run.states = std::move(fewer);
  }
  return kept;
}

// The meshes of each replay's scene, packed: the first replay of a robot gets the data, the others its number.
void add_pictures(const std::vector<json>& pictures, size_t most_bytes, json& replays) {
  std::map<std::string, size_t> first;  // replay by the meshes' text
  std::map<size_t, std::string> packed;
  size_t bytes = 0;
  for (size_t i = 0; i < pictures.size(); ++i) {
    if (pictures[i].is_null()) continue;
    const std::string text = dump_json(pictures[i]);
    const auto [found, fresh] = first.try_emplace(text, i);
    if (!fresh) {
      replays[i]["pictures"] = {{"like", found->second}};
      continue;
    }
    packed[i] = base64(deflated(text));
    bytes += packed[i].size();
  }
  const double share = static_cast<double>(most_bytes) / static_cast<double>(std::max<size_t>(bytes, 1));
  for (auto& [i, data] : packed) {
    if (share < 1) {
      Pictures fewer = parse_pictures(pictures[i]);
      simplify(fewer, static_cast<size_t>(0.9 * share * static_cast<double>(fewer.triangles())));
      data = base64(deflated(dump_json(pictures_json(fewer))));
    }
    replays[i]["pictures"] = {{"data", std::move(data)}};
  }
}

}  // namespace

std::string base64(const std::string& bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    const auto byte = [&](size_t at) {
      return at < bytes.size() ? static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[at])) : 0U;
    };
    const std::uint32_t three = byte(i) << 16 | byte(i + 1) << 8 | byte(i + 2);
    out += kDigits[three >> 18];
    out += kDigits[three >> 12 & 63];
    out += i + 1 < bytes.size() ? kDigits[three >> 6 & 63] : '=';
    out += i + 2 < bytes.size() ? kDigits[three & 63] : '=';
  }
  return out;
}

json replays_data(const Store& store, const ReplayOptions& options) {
  std::vector<ReplaySource> sources;
  const std::vector<SystemRow> systems = store.systems();
  for (const SceneRow& scene : store.scenes()) {
    const json drawn = json::parse(scene.json, nullptr, /*allow_exceptions=*/false);
    if (!drawn.is_object() || !drawn.contains("bodies")) continue;
    const auto system = std::ranges::find(systems, scene.system, &SystemRow::name);
    const json facts = facts_of(system == systems.end() ? "" : system->json);
    sources.push_back({scene.system, scene.json,
                       kept_runs(store, scene.system, drawn.at("bodies").size(), options.most_contenders,
                                 text_fact(facts, "trained_in"))});
  }
  return replays_data(sources, options);
}

json replays_data(const std::vector<ReplaySource>& sources, const ReplayOptions& options) {
  json replays = json::array();
  std::vector<json> pictures;                       // of each replay
  std::vector<const std::vector<ReplayRun>*> kept;  // of each replay
  for (const ReplaySource& source : sources) {
    json drawn = json::parse(source.scene, nullptr, /*allow_exceptions=*/false);
    if (!drawn.is_object() || !drawn.contains("bodies") || source.runs.empty()) continue;
    const size_t bodies = drawn.at("bodies").size();
    pictures.push_back(drawn.value("pictures", json()));
    drawn.erase("pictures");
    replays.push_back({{"system", source.system},
                       {"scene", std::move(drawn)},
                       {"frame_ms", 0},
                       {"frames", 0},
                       {"bodies", bodies},
                       {"position_step_m", options.position_step_m},
                       {"rotation_step", options.rotation_step},
                       {"position_error_m", 0.0},
                       {"rotation_error_rad", 0.0},
                       {"runs", json::array()},
                       {"left_out", json::array()}});
    kept.push_back(&source.runs);
  }
  add_pictures(pictures, options.most_picture_bytes, replays);
  size_t bytes = 0;
  std::vector<const std::vector<State>*> base(kept.size(), nullptr);  // the first run on the page
  // The references of all systems come before any other run.
  for (const bool references : {true, false}) {
    for (size_t i = 0; i < kept.size(); ++i) {
      json& replay = replays[i];
      const std::vector<State>& first = kept[i]->front().states;
      const double reference_ms = kept[i]->front().timestep_ms;
      const double sample_ms = 1000 * (first[1].time - first[0].time);
      const auto stride = static_cast<size_t>(std::max(1.0, std::ceil(options.least_frame_ms / sample_ms - 1e-9)));
      replay["frame_ms"] = sample_ms * static_cast<double>(stride);
      for (const auto& [contender, timestep_ms, states] : *kept[i]) {
        if ((timestep_ms == reference_ms) != references) continue;
        const Packed packed = pack(states, stride, options);
        if (bytes + packed.data.size() > options.most_bytes) {
          replay["left_out"].push_back(references ? contender
                                                  : fmt::format("{} at {} ms", contender, timestep_label(timestep_ms)));
          continue;
        }
        bytes += packed.data.size();
        if (base[i] == nullptr) base[i] = &states;
        const auto raise = [&](const char* key, auto value) {
          replay[key] = std::max(replay.at(key).get<decltype(value)>(), value);
        };
        raise("frames", packed.frames);
        raise("position_error_m", packed.position_error_m);
        raise("rotation_error_rad", packed.rotation_error_rad);
        replay["runs"].push_back({{"contender", contender},
                                  {"timestep_ms", timestep_ms},
                                  {"frames", packed.frames},
                                  {"distance_m", distances(states, *base[i], stride)},
                                  {"data", packed.data}});
      }
    }
  }
  return replays;
}

}  // namespace assay
