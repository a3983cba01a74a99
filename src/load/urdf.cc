#include "load/urdf.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <tinyxml2.h>

#include "load/urdf/joints.h"
#include "load/urdf/masses.h"
#include "load/urdf/numbers.h"
#include "load/urdf/pictures.h"
#include "load/urdf/repair.h"
#include "load/urdf/robot.h"
#include "load/urdf/root_joint.h"
#include "load/urdf/shapes.h"
#include "load/urdf/tree.h"
#include "load/urdf/unread.h"

namespace assay {
namespace {

namespace xml = tinyxml2;

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

// Writes an element and what is below it; each begins on the line that it has in its document, so that MuJoCo's
// messages name the user's lines.
void write_on_its_line(const xml::XMLElement& element, int& line, std::string& text) {
  for (; line < element.GetLineNum(); ++line) text += '\n';
  text += fmt::format("<{}", element.Name());
  for (const xml::XMLAttribute* a = element.FirstAttribute(); a != nullptr; a = a->Next()) {
    std::string value = escaped(a->Value());
    std::ranges::replace(value, '\n', ' ');
    text += fmt::format(" {}=\"{}\"", a->Name(), value);
  }
  text += '>';
  for (const xml::XMLElement* e = element.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
    write_on_its_line(*e, line, text);
  }
  text += fmt::format("</{}>", element.Name());
}

// Finds all problems of a document that is a tree, and adapts it to MuJoCo's reader.
void adapt(urdf::Robot& robot) {
  note_lines(robot);
  note_unread_parts(robot);
  refuse_loops(robot);
  read_compiler_settings(robot);
  urdf::Pictures pictures(robot);
  pictures.leave_out();
  check_shapes(robot);
  lock_joints(robot);
  urdf::Masses masses(robot);
  masses.read();
  apply_root_joint(robot);
  masses.scale_to_total();
  robot.result.has_mass = std::ranges::any_of(robot.links, [](const urdf::Link& link) { return link.mass > 0; });
  pictures.measure(masses);
  masses.find_idle();
  masses.check();
  masses.write();
  adapt_joints(robot);
  note_extensions(robot);
  adapt_meshes(robot);
}

}  // namespace

bool UrdfDocument::refused() const {
  return std::ranges::any_of(problems, [](const Problem& p) { return p.severity == Severity::kRefused; });
}

std::string root_element(const std::string& text) {
  xml::XMLDocument document;
  document.Parse(text.data(), text.size());
  return document.Error() || document.RootElement() == nullptr ? "" : document.RootElement()->Name();
}

UrdfDocument read_urdf(const std::string& text, const std::string& path, const LoadOptions& options) {
  urdf::Robot robot(text, path, options);
  if (robot.document.Error()) {
    robot.refuse("", robot.document.ErrorLineNum(),
                 fmt::format("is not well-formed XML: {}", robot.document.ErrorName()), "correct it at that line");
    return std::move(robot.result);
  }
  if (refuse_xacro(robot) || !read_elements(robot) || !check_numbers(robot, nullptr) || !build_tree(robot)) {
    return std::move(robot.result);
  }
  adapt(robot);
  if (!robot.result.refused()) {
    int line = 1;
    write_on_its_line(*robot.element, line, robot.result.text);
    robot.result.text += '\n';
  }
  return std::move(robot.result);
}

std::string mend_urdf(const std::string& text, const std::string& path, const std::string& out,
                      std::vector<Mend>& mends, const LoadOptions& options) {
  urdf::Robot robot(text, path, options);
  urdf::Repairs repairs = repairs_of(robot, out);
  mends = std::move(repairs.mends);
  return edited(text, repairs.edits);
}

}  // namespace assay
