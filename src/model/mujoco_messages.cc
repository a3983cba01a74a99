#include "model/mujoco_messages.h"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"

namespace assay {
namespace {

std::mutex& one_at_a_time() {
  static std::mutex instance;
  return instance;
}

void handle(const mjLogMessage* message) {
  if (message->level == mjLOG_WARNING) MessageGuard::warnings().emplace_back(message->subject);
  if (message->level == mjLOG_ERROR) throw InputError(fmt::format("MuJoCo: {}", message->subject));
}

}  // namespace

MessageGuard::MessageGuard() : lock_(one_at_a_time()), previous_(mju_setLogHandler(&handle)) { warnings().clear(); }
MessageGuard::~MessageGuard() { mju_setLogHandler(previous_); }

std::vector<std::string>& MessageGuard::warnings() {
  static std::vector<std::string> collected;
  return collected;
}

std::string one_line(std::string_view message) {
  std::string line;
  for (const char c : message) {
    if (c != '\n') {
      line += c;
    } else if (!line.empty() && line.back() != ' ') {
      line += ' ';
    }
  }
  while (!line.empty() && (line.back() == ' ' || line.back() == '.')) line.pop_back();
  return line;
}

std::string mend_of(std::string_view message) {
  constexpr std::array<std::pair<std::string_view, const char*>, 17> kMends = {
      {{"Error opening file", "put it there or correct its name, which counts from the model's folder"},
       {"already included", "include a file once"},
       {"repeated name", "rename one of the two"},
       {"bad format in attribute", "give it numbers"},
       {"unrecognized attribute", "remove it, or correct its name"},
       {"unrecognized element", "remove it, or correct its name"},
       {"XML parse error", "correct the XML there"},
       {"XML_ERROR", "correct the XML there"},
       {"number of faces should be between", "simplify the mesh, of which only the convex hull collides"},
       {"stl_decoder", "export the mesh again as binary STL"},
       {"coplanar", "give the mesh a thickness, or use a thin box"},
       {"is not finite", "export the mesh again"},
       {"must be positive", "make it positive"},
       {"mass and inertia of moving bodies",
        "give it an <inertial>, or a geom of positive size and density, whose group is in inertiagrouprange"},
       {"is repeated in equality", "name two different ones"},
       {"unknown", "correct the name"},
       {"not found", "correct the name"}}};
  const auto found = std::ranges::find_if(
      kMends, [&](const auto& mend) { return message.find(mend.first) != std::string_view::npos; });
  return found == kMends.end() ? "" : found->second;
}

}  // namespace assay
