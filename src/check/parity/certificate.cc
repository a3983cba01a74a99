#include "check/parity/certificate.h"

#include <fmt/format.h>

#include "base/text.h"

namespace assay::parity {

using Json = nlohmann::ordered_json;

std::string verdict_of(const Certificate& certificate) {
  if (!certificate.failure.empty()) return "not examined";
  if (!certificate.settled()) return "not settled";
  if (certificate.agrees()) return "same";
  return certificate.causes.empty() ? "unexplained" : "differs";
}

std::string cause_text(const Json& cause) {
  std::string text = fmt::format("{}: {} {}", cause.at("element").get<std::string>(),
                                 cause.at("parameter").get<std::string>(), cause.at("seen").get<std::string>());
  if (const auto alike = cause.at("alike").get<std::vector<std::string>>(); !alike.empty()) {
    text += fmt::format(" (or, which acts the same, {})", join(alike, ", or "));
  }
  return text;
}

Json certificate_json(const Model& model, const Certificate& certificate) {
  Json joints = Json::array();
  for (const JointErrors& joint : certificate.joints) {
    Json row = {{"element", joint.element}};
    for (int p = 0; p < kParts; ++p) {
      const PartError& part = joint.parts[static_cast<size_t>(p)];
      row[part_name(static_cast<Part>(p))] = {{"error", part.error}, {"noise", part.noise}};
    }
    joints.push_back(std::move(row));
  }
  Json limits = Json::array();
  for (const LimitPlace& place : certificate.limits) {
    limits.push_back({{"joint", model.joints[place.joint].name},
                      {"upper", place.upper},
                      {"expected", place.expected},
                      {"found", place.found},
                      {"place", place.found ? Json(place.place) : Json()}});
  }
  Json causes = Json::array();
  for (const Cause& cause : certificate.causes) {
    causes.push_back({{"element", cause.element},
                      {"parameter", cause.parameter},
                      {"seen", cause.seen},
                      {"alike", cause.alike},
                      {"change", cause.change},
                      {"effect", cause.effect},
                      {"explains", cause.explains}});
  }
  return {{"contender", certificate.contender},
          {"engine", certificate.engine},
          {"beside", certificate.beside},
          {"verdict", verdict_of(certificate)},
          {"error", certificate.error},
          {"noise", certificate.noise},
          {"tolerance", certificate.tolerance()},
          {"unexplained", certificate.unexplained},
          {"raised", certificate.raised},
          {"declared", certificate.differences},
          {"failure", certificate.failure},
          {"joints", joints},
          {"limits", limits},
          {"causes", causes}};
}

}  // namespace assay::parity
