#include "check/parity/examination.h"

#include <algorithm>
#include <csignal>
#include <utility>

#include <fmt/format.h>

#include "base/console.h"
#include "base/exit_status.h"
#include "base/json.h"
#include "check/parity/certificate.h"
#include "engines/engine_files.h"
#include "isolate/guarded_child.h"
#include "isolate/interruption.h"
#include "isolate/processes.h"
#include "isolate/sandbox.h"

namespace assay::parity {
namespace {

std::string percent(double share) { return fmt::format("{:.2g} %", 100 * share); }

// The largest error of a kind over the joints, as a cell.
std::string cell(const nlohmann::ordered_json& certificate, const char* part) {
  double most = 0, noise = 0;
  for (const nlohmann::ordered_json& joint : certificate.at("joints")) {
    const double error = joint.at(part).at("error").get<double>();
    if (error < most) continue;
    most = error;
    noise = joint.at(part).at("noise").get<double>();
  }
  return most <= std::max(4 * noise, 1e-9) ? fmt::format("< {}", percent(std::max(4 * noise, 1e-9))) : percent(most);
}

}  // namespace

std::vector<ResolvedContender> contenders_for(const Model& model, bool all) {
  const Registry& registry = Registry::instance();
  std::vector<ResolvedContender> contenders;
  for (const std::string& name : registry.contender_names()) {
    ResolvedContender contender = registry.resolve(name);
    const Capabilities own = contender.engine->capabilities(contender.settings);
    if (own.order < 1) continue;
    const auto known = std::ranges::find(contenders, contender.engine, &ResolvedContender::engine);
    if (all || known == contenders.end()) {
      contenders.push_back(std::move(contender));
      continue;
    }
    const auto refuses = [&model](const ResolvedContender& each) {
      return std::ranges::any_of(each.engine->check(without_contacts(model), each.settings),
                                 [](const Limitation& l) { return l.fidelity == Fidelity::kRefused; });
    };
    const Capabilities other = known->engine->capabilities(known->settings);
    const bool better = (own.coordinates == Coordinates::kJoint && other.coordinates == Coordinates::kMaximal) ||
                        (own.coordinates == other.coordinates && own.precision == Precision::kDouble &&
                         other.precision == Precision::kSingle);
    if ((better && !refuses(contender)) || (refuses(*known) && !refuses(contender))) *known = std::move(contender);
  }
  return contenders;
}

std::optional<nlohmann::ordered_json> examined_apart(const Model& model, const std::string& contender,
                                                     const std::string& engine,
                                                     const std::function<Certificate()>& make) {
  nlohmann::ordered_json certificate;
  const ChildEnd end = run_in_child(
      [&](const Send& send) {
        std::signal(SIGINT, SIG_DFL);
        std::signal(SIGTERM, SIG_DFL);
        enter_sandbox({.readable = engine_files(), .writable = engine_caches()});
        send(dump_json(certificate_json(model, make())));
        return exits::kDone;
      },
      [&](const std::string& line) { certificate = nlohmann::ordered_json::parse(line); });
  if (interrupted()) return std::nullopt;
  if (!certificate.is_null()) return certificate;
  if (end.from_outside()) throw EndedFromOutside(fmt::format("examining {}", contender), end.signal);
  Certificate failed;
  failed.contender = contender;
  failed.engine = engine;
  failed.failure = end.signal != 0 ? "it crashed with " + end.signal_text() : "its process ended early";
  return certificate_json(model, failed);
}

std::string certificates_text(const nlohmann::ordered_json& certificates) {
  std::string out;
  std::vector<std::vector<std::string>> rows;
  for (const nlohmann::ordered_json& c : certificates) {
    std::vector<std::string> row = {c.at("contender").get<std::string>(), status(c.at("verdict").get<std::string>())};
    for (int p = 0; p < kParts; ++p) {
      row.push_back(c.at("joints").empty() ? "" : cell(c, part_name(static_cast<Part>(p))));
    }
    rows.push_back(std::move(row));
  }
  out += "\n" + table({"contender", "robot", "inertia", "Coriolis", "gravity", "springs", "damping", "dry friction",
                       "armature", "torque"},
                      rows, {2, 3, 4, 5, 6, 7, 8, 9});
  out +=
      paragraph(
          "Largest error of a joint's force, relative to the joint's largest force of that kind; armature: relative to "
          "the joint's inertia; torque: of its gain; \"<\": not told from rounding and the steps' own error.") +
      "\n";
  for (const nlohmann::ordered_json& c : certificates) {
    const auto text = [&c](const char* key) { return c.at(key).get<std::string>(); };
    if (text("verdict") == "same") continue;
    if (text("verdict") == "not settled") {
      out +=
          paragraph(fmt::format("{}: its own error in one small step is up to {}, which hides what is to be seen here",
                                text("contender"), percent(c.at("noise").get<double>())),
                    4) +
          "\n";
      continue;
    }
    out += heading(text("contender")) + "\n";
    if (!text("failure").empty()) out += paragraph("  " + text("failure"), 4);
    for (const nlohmann::ordered_json& cause : c.at("causes")) {
      out += paragraph("  " + cause_text(cause), 4);
    }
    if (text("verdict") == "unexplained" ||
        (text("verdict") == "differs" && c.at("unexplained").get<double>() > c.at("tolerance").get<double>())) {
      out += paragraph(fmt::format("  {} of the joint's inertia times 20 rad/s^2 stay unexplained by any one parameter",
                                   percent(c.at("unexplained").get<double>())),
                       4);
    }
    size_t shown = 0;
    for (const nlohmann::ordered_json& declared : c.at("declared")) {
      constexpr size_t kMost = 4;
      if (++shown > kMost) {
        out += paragraph(fmt::format("  and {} more declared", c.at("declared").size() - kMost), 4);
        break;
      }
      out += paragraph("  declared: " + declared.get<std::string>(), 4);
    }
    if (!text("raised").empty()) out += paragraph("  examined with " + text("raised"), 4);
    out += "\n";
  }
  return out;
}

}  // namespace assay::parity
