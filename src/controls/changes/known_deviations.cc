// Which declared departures of two contenders concern which causes of a gap.
#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "controls/changes/swaps.h"

namespace assay {
namespace {

// What conformance tests, by a part of their names, and limitations, by the beginning of their elements, say something
// about: causes of swaps.
struct Concern {
  std::string_view of;
  std::vector<std::string> causes;
};

const std::vector<Concern>& concerns_of_tests() {
  static const std::vector<std::string> friction = {"contact friction", "friction model"};
  static const std::vector<Concern> list = {{"friction-", friction},
                                            {"distances", friction},
                                            {"far-from-origin", friction},
                                            {"sliding-capsule", friction},
                                            {"sphere-rolls", friction},
                                            {"stick-and-slip", friction},
                                            {"box-slides", friction},
                                            {"hull-slides", friction},
                                            {"-friction", {"dry friction"}},
                                            {"inelastic-impact", {"contact softness", "contacts"}},
                                            {"stack-", {"contact softness", "solver iterations", "contacts"}},
                                            {"resting-", {"contact softness", "contacts"}},
                                            {"spring", {"damping law", "damping", "stiffness"}},
                                            {"armature", {"armature"}},
                                            {"limit", {"limits"}},
                                            {"wide-range", {"limits"}},
                                            {"torque-free-top", {"gyroscopic torque"}},
                                            {"spinning-bodies", {"gyroscopic torque"}}};
  return list;
}

const std::vector<Concern>& concerns_of_limitations() {
  static const std::vector<Concern> list = {{"friction", {"contact friction", "friction model"}},
                                            {"positions", {"contact friction", "precision", "contacts"}}};
  return list;
}

void add(std::vector<KnownDeviation>& known, bool in_b, const std::string& of, const std::string& reason,
         const std::vector<std::string>& causes) {
  const bool there = std::ranges::any_of(
      known, [&](const KnownDeviation& each) { return each.in_b == in_b && each.of == of && each.reason == reason; });
  if (!there) known.push_back({in_b, of, reason, causes});
}

}  // namespace

std::vector<KnownDeviation> known_deviations(const Pairing& pairing) {
  std::vector<KnownDeviation> known;
  for (const bool in_b : {false, true}) {
    const Recipe recipe = recipe_of(in_b ? pairing.b : pairing.a);
    Settings settings = recipe.contender.settings;
    settings.timestep = pairing.timestep_ms / 1e3 * recipe.timestep_factor;
    for (const Deviation& deviation : recipe.contender.engine->capabilities(settings).deviations) {
      if (settings.timestep < deviation.finest || settings.timestep > deviation.coarsest) continue;
      const auto found = std::ranges::find_if(
          concerns_of_tests(), [&](const Concern& each) { return deviation.test.find(each.of) != std::string::npos; });
      if (found != concerns_of_tests().end()) add(known, in_b, deviation.test, deviation.reason, found->causes);
    }
    for (const Limitation& limitation : recipe.contender.engine->check(*pairing.model, settings)) {
      const auto found = std::ranges::find_if(
          concerns_of_limitations(), [&](const Concern& each) { return limitation.element.starts_with(each.of); });
      if (found != concerns_of_limitations().end()) add(known, in_b, limitation.element, limitation.how, found->causes);
    }
  }
  return known;
}

}  // namespace assay
