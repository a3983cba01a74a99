#include "load/urdf/pictures.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <tinyxml2.h>

#include "load/urdf/values.h"

namespace assay::urdf {
namespace xml = tinyxml2;

void Pictures::add(const Link& link, const Pose& X_LV, const xml::XMLElement& shape) {
  const std::string_view type = shape.Name();
  const double radius = number_of(&shape, "radius", 0), length = number_of(&shape, "length", 0);
  Vec3 half = Vec3::Zero();
  if (type == "box") half = vector_of(&shape, "size", Vec3::Zero()) / 2;
  if (type == "sphere") half = Vec3::Constant(radius / std::numbers::sqrt3);
  if (type == "cylinder" || type == "capsule") {
    half = Vec3(radius / std::numbers::sqrt2, radius / std::numbers::sqrt2, length / 2);
  }
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 at((corner & 1) != 0 ? half.x() : -half.x(), (corner & 2) != 0 ? half.y() : -half.y(),
                  (corner & 4) != 0 ? half.z() : -half.z());
    const Vec3 p_L = X_LV * at;
    if (!half.isZero(0) && p_L.allFinite()) pictures_.emplace_back(robot_.link_of.at(link.name), p_L);
  }
}

void Pictures::leave_out() {
  std::map<std::string, std::string> colours;  // by material
  const auto add_colour = [&](const xml::XMLElement& material) {
    const xml::XMLElement* colour = material.FirstChildElement("color");
    const std::vector<double> rgba = numbers_of(colour, "rgba");
    const bool valid = rgba.size() == 4 && std::ranges::all_of(rgba, [](double v) { return std::isfinite(v); });
    if (valid) {
      const std::string own = fmt::format("{} {} {} {}", rgba[0], rgba[1], rgba[2], rgba[3]);
      colours.try_emplace(text_of(&material, "name"), own);
      return own;
    }
    if (colour != nullptr) {
      robot_.note(fmt::format("<color> in line {} has rgba=\"{}\", which is no colour: grey is drawn",
                              colour->GetLineNum(), text_of(colour, "rgba")));
    }
    return std::string();
  };
  while (xml::XMLElement* material = robot_.element->FirstChildElement("material")) {
    add_colour(*material);
    robot_.element->DeleteChild(material);
  }
  std::map<std::string, std::string> colour_of;  // link -> its last visual's own colour
  std::map<std::string, std::string> material_of;
  for (const Link& link : robot_.links) {
    while (xml::XMLElement* visual = link.element->FirstChildElement("visual")) {
      const xml::XMLElement* geometry = visual->FirstChildElement("geometry");
      if (geometry != nullptr && geometry->FirstChildElement() != nullptr) {
        add(link, origin_of(*visual), *geometry->FirstChildElement());
      } else {
        robot_.note(fmt::format("a visual of link '{}' (line {}) has no shape and is not drawn", link.name,
                                visual->GetLineNum()));
      }
      if (const xml::XMLElement* material = visual->FirstChildElement("material")) {
        colour_of[link.name] = add_colour(*material);
        material_of[link.name] = text_of(material, "name");
      }
      link.element->DeleteChild(visual);
    }
  }
  for (const Link& link : robot_.links) {
    std::string& rgba = colour_of[link.name];
    if (const auto known = colours.find(material_of[link.name]); rgba.empty() && known != colours.end()) {
      rgba = known->second;
    }
    if (rgba.empty() || link.element->FirstChildElement("collision") == nullptr) continue;
    // MuJoCo colours what follows
    xml::XMLElement* visual = robot_.document.NewElement("visual");
    link.element->InsertFirstChild(visual);
    visual->InsertNewChildElement("geometry")->InsertNewChildElement("sphere")->SetAttribute("radius", "1");
    xml::XMLElement* material = visual->InsertNewChildElement("material");
    material->SetAttribute("name", link.name.c_str());
    material->InsertNewChildElement("color")->SetAttribute("rgba", rgba.c_str());
  }
}

void Pictures::measure(const Masses& masses) {
  for (const auto& [i, p_L] : pictures_) {
    const int head = masses.head(i);
    double& reach = robot_.result.drawn_reach[robot_.links[static_cast<size_t>(head)].name];
    reach = std::max(reach, (masses.X_HL(i) * p_L - masses.whole(head).p).norm());
  }
}

}  // namespace assay::urdf
