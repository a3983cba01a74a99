#include "check/pairing/pairing_text.h"

#include <algorithm>
#include <map>
#include <vector>

#include <fmt/format.h>

#include "base/console.h"
#include "base/quantity.h"
#include "base/text.h"

namespace assay::pairing {
namespace {

std::string percent(double share) {
  if (share == 0) return "0 %";
  return share < 1e-4 ? fmt::format("{:.1g} %", 100 * share) : fmt::format("{:.3g} %", 100 * share);
}

Json side_json(const Side& side, size_t joints, double mass) {
  return {{"file", side.file}, {"format", side.format.name},         {"hash", side.model.hash},
          {"joints", joints},  {"bodies", side.model.bodies.size()}, {"mass", mass}};
}

Json findings_json(const std::vector<Finding>& findings) {
  Json list = Json::array();
  for (const Finding& finding : findings) list.push_back({{"element", finding.element}, {"what", finding.words}});
  return list;
}

std::string side_line(const char* name, const Json& side) {
  return fmt::format("{}  {} ({}): {}, {:.4g} kg\n", name, side.at("file").get<std::string>(),
                     side.at("format").get<std::string>(), counted(side.at("joints").get<size_t>(), "joint"),
                     side.at("mass").get<double>());
}

std::string matches_line(const Json& comparison) {
  std::map<std::string, size_t> ways;
  size_t actuators = 0;
  for (const Json& match : comparison.at("matches")) {
    const auto kind = match.at("kind").get<std::string>();
    if (kind == "actuator") ++actuators;
    if (kind == "joint") ++ways[match.at("how").get<std::string>()];
  }
  std::vector<std::string> parts;
  for (const auto& [way, count] : ways) parts.push_back(fmt::format("{} by {}", count, way));
  std::string text =
      fmt::format("{} of {} and {} joints match", comparison.at("joints_matched").get<size_t>(),
                  comparison.at("a").at("joints").get<size_t>(), comparison.at("b").at("joints").get<size_t>());
  if (!parts.empty()) text += fmt::format(" ({})", join(parts, ", "));
  if (actuators > 0) text += fmt::format(", and {}", counted(actuators, "actuator"));
  return text;
}

}  // namespace

Json comparison_json(const Side& a, const Side& b, const Comparison& comparison) {
  Json matches = Json::array(), differences = Json::array();
  for (const Match& match : comparison.matches) {
    matches.push_back({{"kind", match.kind},
                       {"a", match.a},
                       {"b", match.b},
                       {"how", how_text(match.how)},
                       {"reversed", match.reversed}});
  }
  const auto number = [](const std::optional<double>& value) { return value ? Json(*value) : Json(); };
  for (const Difference& d : comparison.differences) {
    differences.push_back({{"element", d.element},
                           {"parameter", d.parameter},
                           {"unit", d.unit},
                           {"a", number(d.a)},
                           {"b", number(d.b)},
                           {"words", d.words},
                           {"effect", d.effect},
                           {"share", d.share},
                           {"felt", d.felt}});
  }
  const Motion& motion = comparison.motion;
  return {{"a", side_json(a, comparison.joints_a, comparison.mass_a)},
          {"b", side_json(b, comparison.joints_b, comparison.mass_b)},
          {"verdict", comparison.same() ? "same" : "differs"},
          {"joints_matched", comparison.joints_matched},
          {"matches", matches},
          {"findings", findings_json(comparison.findings)},
          {"differences", differences},
          {"total_effect", comparison.total},
          {"not_in_a_format", findings_json(comparison.format_findings)},
          {"notes", comparison.notes},
          {"motion",
           {{"contender", motion.contender},
            {"failure", motion.failure},
            {"distance", motion.distance},
            {"body", motion.body},
            {"travelled", motion.travelled},
            {"note", motion.note}}}};
}

std::string comparison_text(const Json& comparison, bool matches, bool all) {
  std::string out = side_line("A", comparison.at("a")) + side_line("B", comparison.at("b"));
  out += paragraph(matches_line(comparison) + (matches ? "" : "; --matches lists them"), 4) + "\n";
  if (matches) {
    std::vector<std::vector<std::string>> rows;
    for (const Json& match : comparison.at("matches")) {
      rows.push_back({match.at("kind").get<std::string>(), match.at("a").get<std::string>(),
                      match.at("b").get<std::string>(),
                      match.at("how").get<std::string>() + (match.at("reversed").get<bool>() ? ", reversed" : "")});
    }
    if (!rows.empty()) out += table({"", "A", "B", "matched by"}, rows) + "\n";
  }
  constexpr size_t kMost = 20;
  const auto list = [&](const Json& findings, const std::string& before) {
    size_t shown = 0;
    for (const Json& finding : findings) {
      if (++shown > kMost && !all) {
        out += fmt::format("  and {} more (--all)\n", findings.size() - kMost);
        break;
      }
      out += paragraph(fmt::format("  {}{}: {}", before, finding.at("element").get<std::string>(),
                                   finding.at("what").get<std::string>()),
                       4);
    }
  };
  const Json& differences = comparison.at("differences");
  list(comparison.at("findings"), "");
  if (!comparison.at("findings").empty() && !differences.empty()) out += "\n";
  std::vector<std::vector<std::string>> rows;
  for (const Json& d : differences) {
    if (rows.size() == kMost && !all) break;
    rows.push_back({percent(d.at("effect").get<double>()), percent(d.at("share").get<double>()),
                    d.at("element").get<std::string>(), d.at("parameter").get<std::string>(),
                    d.at("words").get<std::string>()});
  }
  if (!rows.empty()) {
    out += table({"effect", "share", "element", "parameter", "B's instead of A's"}, rows, {0, 1});
    if (rows.size() < differences.size())
      out += fmt::format("  and {} more (--all)\n", differences.size() - rows.size());
    out += "\n" + paragraph(
                      "Effect: how much of A's joint forces changes with this one value of B's, in random motions, "
                      "where it is felt "
                      "most; of limits relative to the range, of drives and friction of contacts to A's value, of "
                      "shapes to their "
                      "size. Share: of the sum of all effects.");
  } else if (comparison.at("findings").empty()) {
    out += "one robot: nothing that moves it differs beyond the rounding of the files\n";
  }
  list(comparison.at("not_in_a_format"), "not compared: ");
  for (const Json& note : comparison.at("notes")) out += paragraph("note: " + note.get<std::string>(), 4);
  const Json& motion = comparison.at("motion");
  const auto text = [&](const char* key) { return motion.at(key).get<std::string>(); };
  if (!text("failure").empty()) {
    out += paragraph(fmt::format("one second in {}: not run, {}", text("contender"), text("failure")), 4);
  } else if (!text("contender").empty()) {
    const std::string body = text("body").empty() ? "" : fmt::format(" (body '{}')", text("body"));
    out += paragraph(fmt::format("one second in {}{}: bodies are up to {} apart{}", text("contender"),
                                 text("note").empty() ? "" : ", " + text("note"),
                                 quantity_text(motion.at("distance").get<double>(), "m"), body),
                     4);
  }
  return out;
}

}  // namespace assay::pairing
