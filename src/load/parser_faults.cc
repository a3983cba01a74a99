#include "load/parser_faults.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <regex>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include "base/text.h"
#include "load/mjcf_document.h"
#include "load/mujoco_messages.h"
#include "load/outside_files.h"

namespace assay {
namespace {

// ---- texts -----------------------------------------------------------------------------------------------------------

int number_after(const std::string& text, std::string_view words) {
  const size_t at = text.find(words);
  if (at == std::string::npos) return 0;
  const size_t from = at + words.size(), end = text.find_first_not_of("0123456789", from);
  return static_cast<int>(parse_integer(text.substr(from, end == std::string::npos ? end : end - from)).value_or(0));
}

void replace_all(std::string& text, std::string_view what, std::string_view with) {
  for (size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + with.size())) {
    text.replace(at, what.size(), with);
  }
}

// A value on one line, and no longer than a reader needs to find it.
std::string brief(const std::string& value) {
  constexpr size_t kMost = 60;
  const std::string line = one_line(value);
  return line.size() <= kMost ? line : line.substr(0, kMost) + "...";
}

// ---- what MuJoCo says ------------------------------------------------------------------------------------------------

// "XML Error: Schema violation: unrecognized attribute: 'sise'\nElement 'geom', line 2" and
// "Error: size 0 must be positive in geom\nElement name 'foot', id 3, line 2" in parts.
struct Message {
  std::string what;
  std::string tag;   // of the element; empty for the compiler's messages
  std::string name;  // of the compiler's
  int line = 0;      // 0 in an included file, or where it is not known

  explicit Message(const std::string& message) {
    std::smatch found;
    static const std::regex kParsers("\n?Element '([^']*)', line (\\d+)\\s*$"),
        kCompilers("\n?Element name '([^\n]*)', id -?\\d+(?:, line (\\d+))?[^\n]*\\s*$");
    what = message;
    if (std::regex_search(message, found, kParsers)) {
      tag = found[1];
    } else if (std::regex_search(message, found, kCompilers)) {
      name = found[1];
    }
    if (!found.empty()) {
      line = static_cast<int>(parse_integer(found[2].str()).value_or(0));
      what = found.prefix();
    }
    static const std::regex kNested("\n?Element name '[^'\n]*', id -?\\d+(?:, line \\d+)?");
    what = one_line(std::regex_replace(what, kNested, ""));
    constexpr std::array<std::string_view, 6> kPrefixes = {
        "XML Error: ", "Error: ", "Schema violation: ", "ParseXML: ", "MuJoCo: ", "engine error: "};
    for (bool again = true; again;) {
      again = false;
      for (const std::string_view prefix : kPrefixes) {
        if (!what.starts_with(prefix)) continue;
        what.erase(0, prefix.size());
        again = true;
      }
    }
  }
};

// ---- the words -------------------------------------------------------------------------------------------------------

// `says` follows on the element: $1 and $2 are parts of MuJoCo's words, {} the attribute $1 as the file writes it.
struct Row {
  const char* pattern;  // of all that MuJoCo says
  const char* kind;     // of the element that it is about: a tag, or a section of the file; empty where it names it
  const char* says;
  const char* mend;
};

constexpr const char* kInertia = R"(give it moments that are positive and none larger than the sum of the others)";
constexpr const char* kOrder = "write the lower bound first";
constexpr const char* kThin = "use a thin box instead, or give the mesh a thickness";

constexpr auto kRows = std::to_array<Row>({
    // the parser
    {"unrecognized attribute: '(.*)'", "", "has an attribute '$1', which MJCF does not know there",
     "remove it, or correct its name"},
    {"unrecognized element", "", "is an element that MJCF does not know there", "remove it, or correct its name"},
    {"unique element '(.*)' found (\\d+) times", "", "has $2 elements <$1> where one is allowed", "keep one of them"},
    {"element '(.*)' is required", "", "lacks the element <$1>", "add it"},
    {"missing element: '(.*)'", "", "lacks the element <$1>", "add it"},
    {"repeated element: '(.*)'", "", "has the element <$1> twice", "keep one of them"},
    {"required attribute missing: '(.*)'", "", "lacks the attribute '$1'", "add it"},
    {"at most one of (.*) can be specified", "", "has more than one of the attributes $1", "keep one of them"},
    {"attributes (.*) must be specified together", "", "has not all of the attributes $1", "give all of them, or none"},
    {"attribute '(.*)' requires attribute '(.*)'", "", "has the attribute '$1' without '$2'", "add '$2'"},
    {"one of (.*) must be specified", "", "has none of the attributes $1", "add one of them"},
    {"bad format in attribute '(.*)'", "", "has {}, which is not a list of numbers",
     "give numbers with blanks between them, whole ones where it is a count"},
    {"attribute '(.*)' does not have enough data", "", "has {}, which has too few numbers",
     "give all of the numbers that MJCF has for it"},
    {"attribute '(.*)' has too much data", "", "has {}, which has too many numbers",
     "give only the numbers that MJCF has for it"},
    {"number is too large in attribute '(.*)'", "", "has {}, which has a number out of range", "give a smaller number"},
    {"(?:problem reading|unknown error in) attribute '(.*)'", "", "has {}, which cannot be read",
     "give numbers with blanks between them"},
    {"attribute '(.*)' (?:may have at most|must have exactly) (\\d+) characters", "",
     "has {}, where $2 characters are allowed", "correct it"},
    {"(?:invalid|duplicate) keyword: '(.*)'", "", "", ""},  // keyword_problem
    {"zero quaternion is not allowed", "", "has a quaternion of length zero", "give quat=\"1 0 0 0\" for no rotation"},
    {"multiple orientation specifiers are not allowed", "",
     "has more than one of quat, axisangle, euler, xyaxes and zaxis", "keep one of them"},
    {"World body cannot have (?:joints|inertia)", "", "is an element of the world, which does not move",
     "put it into a <body>"},
    {"World body cannot have attributes", "", "has attributes", "remove the attributes of <worldbody>"},
    {"unknown default class name '(.*)'", "", "names the class '$1', which no <default> has",
     "correct the name, or remove it"},
    {"unknown default childclass", "", "names a childclass that no <default> has", "correct the name, or remove it"},
    {"repeated default class name", "", "has the name of another default class", "rename one of the two"},
    {"empty class name", "", "has no class name", "name it with class=\"NAME\""},
    {"top-level default class 'main' cannot be renamed", "", "has a class, and the outermost one is called 'main'",
     "put a <default> around it"},
    {"[Ii]nclude element missing file attribute", "", "names no file", "give it file=\"NAME\", or remove it"},
    {"Include element cannot have children", "", "has elements in it", "move them out of <include>"},
    {"File '(.*)' already included", "", "includes '$1', which is included already", "include a file once"},
    {"(?:Include error: ')?Error opening file '(.*?)'+", "", "names the file '$1', which cannot be opened",
     "put it there or correct its name, which counts from the model's folder"},
    {"(?:Error reading|[Ee]mpty|Empty include|Root element missing in) file '(.*?)'", "",
     "names the file '$1', which holds no XML element", "correct its content, or its name"},
    {"Unrecognized XML model type: '(.*)'", "mujoco",
     "begins with <$1>, and a model begins with <mujoco>, <robot> or <sdf>", "name an MJCF, URDF or SDF file"},
    {"XML root element not found", "", "holds no XML element", "name an MJCF or URDF file"},
    {"Attach conflict when attaching '(.*?)' to '(.*?)', policy is '(.*?)' (.*)", "",
     "joins a model whose options are others ($4)", "give both models the same options"},
    {"could not find model '(.*)'", "", "names the model '$1', which <asset> does not have",
     "add a <model> of that name to <asset>, or correct the name"},
    {"could not find (\\w+) '(.*)' in (?:model asset '.*'|the current model.*)", "",
     "names the $1 '$2', which that model does not have", "correct the name"},
    {"cannot (?:self-)?attach: element (.*) already exists.*", "", "attaches an element '$1' that is there already",
     "give each <attach> a prefix of its own"},
    {"elevation data length must match nrow\\*ncol", "", "has another number of heights than nrow times ncol",
     "give nrow times ncol heights"},
    {"global coordinates no longer supported.*", "", "has coordinate=\"global\", which MuJoCo 4 does not read",
     "load and save the file with MuJoCo 2.3.3, and remove the attribute"},
    {"realtime must be greater than 0|extent must be strictly positive|znear must be strictly positive", "",
     "has a number that is not positive", "make it positive, or remove it"},
    {"(n\\w+) must be >= -1", "", "has {}", "give it a number from 0 on, or remove it"},
    {"plugin (.*) not found|unrecognized plugin '.*'|.*for plugin instance", "", "is a plugin, which is not supported",
     "remove it"},
    {"repeated name '(.*)' in (.*)", "", "has the name of another $2", "rename one of the two"},
    {"empty name in (.*)", "", "has no name", "name it"},
    // the compiler
    {"mass and inertia of moving bodies must be larger than mjMINVAL|body mass is too small.*", "body",
     "moves, and its mass or inertia is not positive",
     "give it an <inertial>, or a geom of positive size and density, whose group is in inertiagrouprange"},
    {"mass and inertia cannot be negative", "body", "has a mass or an inertia that is negative", "make it positive"},
    {"mass, inertia or density are negative in geom", "geom", "has a mass or a density that is negative",
     "make it positive"},
    {"inertia must satisfy A \\+ B >= C.*", "body", "has an inertia that breaks the triangle inequality", kInertia},
    {"(?:error ')?inertia must have positive eigenvalues.*", "body", "has an inertia that is not positive", kInertia},
    {"fullinertia and (.*) cannot both be specified", "body", "has fullinertia and $1", "keep one of them"},
    {"size \\d+ must be positive in (\\w+)", "geom", "has a size that is not positive", "make it positive"},
    {"plane size\\(3\\) must be positive", "geom", "has a third size that is not positive",
     "give a plane three sizes, the third positive: size=\"0 0 1\" is an infinite one"},
    {"nan size in geom", "geom", "has a size that is not a number", "give it a number"},
    {"plane only allowed in static bodies", "geom", "is a plane on a body that moves",
     "use a thin box instead, or move the plane to the world"},
    {"fromto points too close in (\\w+)", "", "has a fromto with one point twice", "give it two different points"},
    {"both pos and fromto defined in (\\w+)", "", "has pos and fromto", "keep one of them"},
    {"fromto requires .*|fromto cannot be used with mesh geom", "geom",
     "has a fromto, which only capsules, cylinders, boxes and ellipsoids have", "give it pos, size and quat instead"},
    {"for mesh geoms, inertia should be specified in the mesh asset", "geom", "is a mesh and has shellinertia",
     "give its <mesh> inertia=\"shell\" instead"},
    {"hfield not specified|hfield geom .* must have valid hfieldid", "geom", "is a height field without hfield",
     "give it hfield=\"NAME\" of an <hfield> in <asset>"},
    {"(?:mesh geom .* must have valid meshid|invalid mesh id in mesh geom)", "geom", "is a mesh without mesh",
     "give it mesh=\"NAME\" of a <mesh> in <asset>"},
    {"invalid type in (\\w+)", "", "has a type that it cannot have", "give it another type"},
    {"meshes, hfields and planes not allowed in site", "site", "is a mesh, a height field or a plane",
     "give it another type"},
    {"invalid condim in (.*)", "", "has a condim that is not 1, 3, 4 or 6", "give it one of these"},
    {"range\\[0\\] should be smaller than range\\[1\\] in joint", "joint",
     "is limited, and its range has no lower bound below the upper one", kOrder},
    {"range\\[0\\] should be 0 in ball joint", "joint", "is a ball joint with a range that does not begin at 0",
     "write range=\"0 ANGLE\""},
    {"actfrcrange\\[0\\] should be smaller than actfrcrange\\[1\\] in joint", "joint",
     "has an actuatorfrcrange without a lower bound below the upper one", kOrder},
    {"limits should not be defined in free joint", "joint", "is a free joint with limits", "remove the limits"},
    {"free joint can only be used on top level", "body", "has a free joint and lies in another body",
     "move it into <worldbody>, or give it three slides and a ball instead"},
    {"free joint can only appear by itself|more than 6 dofs in body.*", "body",
     "has a free joint with another joint, or more than six degrees of freedom", "keep the free joint alone"},
    {"ball followed by rotation in body.*", "body", "has a hinge or a ball after a ball", "put a body between the two"},
    {"joint found in world body", "", "has a joint of the world, which does not move", "put the joint into a <body>"},
    {"axis too small in joint", "joint", "has an axis of length zero", "give it a direction, as axis=\"0 0 1\""},
    {"when defined, springdamper values must be positive in joint", "joint", "has a springdamper that is not positive",
     "give two positive numbers, or remove it"},
    {"(?:error|orientation specification error) '(.*)'.*", "", "has an orientation that is none: $1",
     "give its vectors a length, or remove them"},
    {"(mesh|hfield|material|texture|joint|geom|site|body|tendon) '(.*)' not found in .*", "",
     "names the $1 '$2', which the file does not have", "correct the name, or remove it"},
    {"(base|reference|side) site '(.*)' not found .*", "", "names the site '$2', which the file does not have",
     "correct the name, or remove it"},
    {"(?:unknown )?transmission target '(.*)' (?:not found in|for) actuator.*", "actuator",
     "acts on '$1', which the file does not have", "correct the name, or remove the actuator"},
    {"missing transmission target for actuator", "actuator", "acts on nothing",
     "name what it acts on, as joint=\"NAME\", or remove it"},
    {"element '(.*)' is repeated in equality constraint.*", "equality", "joins '$1' to itself",
     "name two different ones"},
    {"unknown element '(.*)' in equality constraint.*", "equality", "names '$1', which the file does not have",
     "correct the name, or remove it"},
    {"(?:connect|weld) constraint supports only .*", "equality", "joins what it cannot join",
     "name two bodies or two sites"},
    {"only HINGE and SLIDE joint allowed in constraint", "equality", "couples a joint that is neither hinge nor slide",
     "couple hinges and slides only"},
    {"unrecognized name '(.*)' of (?:sensorized )?object", "sensor", "names '$1', which the file does not have",
     "correct the name, or remove the sensor"},
    {"missing name of (?:sensorized|reference frame) object in sensor", "sensor", "measures nothing",
     "name what it measures, or remove it"},
    {".* in sensor.*|sensor must be .*", "sensor", "cannot measure that", "correct it, or remove the sensor"},
    {"unknown target body in (\\w+)", "", "names a target that the file does not have", "correct the name"},
    {"invalid (control|force|act) ?range for actuator", "actuator",
     "has a $1 range without a lower bound below the upper one", kOrder},
    {"actrange specified but dyntype is 'none' in actuator", "actuator", "has an actrange and no dynamics",
     "remove actrange"},
    {"inheritrange .*", "actuator", "has an inheritrange that its joint cannot give", "give ctrlrange instead"},
    {"invalid limits in tendon", "tendon", "has a range without a lower bound below the upper one", kOrder},
    {"invalid springlength in tendon", "tendon", "has a springlength without a lower bound below the upper one",
     kOrder},
    {"tendon .*path cannot be empty", "tendon", "has nothing in it", "add its joints or sites, or remove it"},
    {"1st body/geom must be different from 2nd body/geom", "contact", "names one twice", "name two different ones"},
    {"[Kk]eyframe '?(.*?)'?:? (?:has )?invalid (\\w+) size, expected (?:length )?(\\d+).*", "key",
     "has a number of $2 that is not the model's $3", "give $3 numbers, or remove $2"},
    {"[Kk]eyframe '?(.*?)'?:? (?:has )?invalid (\\w+) size, got \\d+, should be (\\d+)", "key",
     "has a number of $2 that is not the model's $3", "give $3 numbers, or remove $2"},
    {"user has more values than (nuser_\\w+) in .*", "", "has more user values than <size $1> says",
     "remove some, or enlarge $1"},
    {"size parameter is not positive in hfield", "hfield", "has a size that is not positive",
     "give it four positive sizes"},
    {"could not read (?:MSH|OBJ|STL|hfield|texture|PNG) file '(.*)'|(?:MSH|PNG|SKN) file '(.*)' is empty", "",
     "has a file that cannot be read, '$1$2'", "export it again, or correct its name"},
    {"(?:decoder failed for|no decoder found for) mesh file '(.*)'", "mesh", "has a file that is no mesh, '$1'",
     "export it again as STL or OBJ"},
    {"number of faces should be between .*", "mesh", "has too many or too few triangles for an STL file",
     "simplify the mesh, of which only the convex hull collides"},
    {".*stl_decoder.*|.*STL file.*", "mesh", "has a file that is no binary STL", "export the mesh again as binary STL"},
    {"vertex coordinate \\d+ is not finite", "mesh", "has a vertex that is not a number", "export the mesh again"},
    {"at least 4 vertices required|not enough vertices|no vertices", "mesh", "has fewer than four vertices",
     "give it four and more, or use a box"},
    {"mesh '.*' has coplanar vertices.*", "mesh", "is flat", kThin},
    {"mesh '.*' has collinear vertices.*", "mesh", "is a line", "use a thin capsule instead"},
    {"mesh '.*' has colocated vertices.*", "mesh", "is a point", "use a small sphere instead"},
    {"mesh (?:volume|surface area) is too small.*", "mesh", "encloses no volume",
     "give it inertia=\"shell\", or a thickness"},
    {"mesh volume is negative.*|faces of mesh '.*' have inconsistent orientation.*", "mesh",
     "has triangles that are turned inside out",
     "turn them (recompute the normals outwards), or give it inertia=\"convex\""},
    {"eigenvalues? of mesh inertia .*", "mesh", "has triangles that enclose no proper volume",
     "give it inertia=\"convex\""},
    {"in face \\d+, vertex index \\d+ does not exist|.*(?:vertex|face|normal|texcoord) data must be.*", "mesh",
     "has faces or data that do not fit its vertices", "export the mesh again"},
    {"qhull error", "mesh", "has no convex hull", kThin},
    {".*(?:[Tt]exture|PNG|gridsize|gridlayout|cubefiles).*", "texture", "is a texture that cannot be read",
     "correct it, or remove it: only pictures need it"},
    {".*flex.*integrator.*", "", "has flexible bodies with an integrator that MuJoCo 4 does not give them",
     "write <option integrator=\"discrete\"/>"},
    {".*(?:GMSH|flexcomp|flex |pin ?grid|pinid|pinrange|[Cc]ount too small|Element size must|Point size must).*", "",
     "is a deformable body, which is not supported, and cannot be read", "remove it"},
});

struct Words {
  std::string message, mend;
};

// What an attribute of that name may say.
std::string keywords_of(const std::string& tag, const std::string& attribute) {
  struct Keywords {
    std::string_view tag, attribute, words;
  };
  constexpr auto kKnown = std::to_array<Keywords>({
      {"joint", "type", "free, ball, slide or hinge"},
      {"geom", "type", "plane, hfield, sphere, capsule, ellipsoid, cylinder, box or mesh"},
      {"site", "type", "sphere, capsule, ellipsoid, cylinder or box"},
      {"compiler", "angle", "radian or degree"},
      {"compiler", "inertiafromgeom", "true, false or auto"},
      {"option", "integrator", "Euler, RK4, implicit or implicitfast"},
      {"option", "cone", "pyramidal or elliptic"},
      {"option", "jacobian", "dense, sparse or auto"},
      {"option", "solver", "PGS, CG or Newton"},
      {"mesh", "inertia", "convex, exact, legacy or shell"},
      {"texture", "type", "2d, cube or skybox"},
      {"general", "dyntype", "none, integrator, filter, filterexact, muscle or user"},
      {"general", "gaintype", "fixed, affine, muscle or user"},
      {"general", "biastype", "none, affine, muscle or user"},
  });
  const auto found = std::ranges::find_if(
      kKnown, [&](const Keywords& each) { return each.tag == tag && each.attribute == attribute; });
  if (found != kKnown.end()) return std::string(found->words);
  if (tag == "flag") return "enable or disable";
  if (attribute == "mode") return "fixed, track, trackcom, targetbody or targetbodycom";
  if (attribute.ends_with("limited")) return "true, false or auto";
  return "";
}

Words keyword_problem(const std::string& keyword, const DocumentElement* element) {
  for (const auto& [name, value] : element == nullptr ? decltype(element->attributes){} : element->attributes) {
    if (value.find(keyword) == std::string::npos) continue;
    const std::string words = keywords_of(element->tag, name);
    return {fmt::format("has {}=\"{}\", which is no word that MJCF has there", name, brief(value)),
            words.empty() ? fmt::format("give {} one of the words that MJCF has for it, such as true or false", name)
                          : fmt::format("give {} one of {}", name, words)};
  }
  return {fmt::format("has the word '{}', which MJCF does not know there", keyword), "correct it"};
}

// "remove it, or correct its name (did you mean 'size'?)", by the attributes that MuJoCo's schema prints after the tag.
std::string likely_attribute(const std::string& tag, const std::string& unknown) {
  std::vector<char> buffer(1 << 17);
  const int size = mj_printSchema(nullptr, buffer.data(), static_cast<int>(buffer.size()), 0, 1);
  const std::string schema(buffer.data(), static_cast<size_t>(std::clamp<int>(size, 0, 1 << 17)));
  std::vector<std::string> known;
  static const std::regex kLine("^ *(?:(\\w+) \\(.\\) *)?([\\w ]*)$");
  bool within = false;
  for (size_t begin = 0; begin < schema.size();) {
    const size_t end = std::min(schema.find('\n', begin), schema.size());
    std::smatch parts;
    const std::string line = schema.substr(begin, end - begin);
    begin = end + 1;
    if (!std::regex_match(line, parts, kLine)) continue;
    if (parts[1].matched) within = parts[1] == tag;
    if (!within) continue;
    const std::string words = parts[2];
    static const std::regex kWord("\\w+");
    for (std::sregex_iterator word(words.begin(), words.end(), kWord), none; word != none; ++word) {
      known.push_back(word->str());
    }
  }
  const auto likely = nearest_name(unknown, known);
  return likely ? fmt::format("remove it, or correct its name (did you mean '{}'?)", *likely)
                : "remove it, or correct its name";
}

// MuJoCo's words where the table has none: without its numbers of elements and its constants.
std::string cleaned(std::string what) {
  static const std::regex kIds(" ?\\(id ?=? ?\\d+\\)| id \\d+"), kIn(",? (?:in|for) \\w+(?: \\d+)?$");
  what = std::regex_replace(what, kIds, "");
  what = std::regex_replace(what, kIn, "");
  replace_all(what, "mjMINVAL", "1e-15");
  return what;
}

Words words_for(const Message& said, const DocumentElement* element) {
  for (const Row& row : kRows) {
    std::smatch parts;
    if (!std::regex_match(said.what, parts, std::regex(row.pattern))) continue;
    if (row.says[0] == '\0') return keyword_problem(parts[1], element);
    std::string message = parts.format(row.says), mend = parts.format(row.mend);
    const std::string first = parts.size() > 1 ? parts[1].str() : "";
    if (message.find("{}") != std::string::npos) {
      replace_all(message, "{}",
                  element == nullptr ? fmt::format("the attribute '{}'", first)
                                     : fmt::format("{}=\"{}\"", first, brief(element->attribute(first))));
    }
    if (said.what.starts_with("unrecognized attribute")) mend = likely_attribute(said.tag, first);
    return {message, mend};
  }
  const std::string words = cleaned(said.what);
  if (said.tag == "flexcomp") {
    return {fmt::format("is a deformable body, which is not supported, and cannot be read: {}", words), "remove it"};
  }
  return {fmt::format("is not valid in MuJoCo: {}", words), "correct it, or remove the element"};
}

// ---- the element -----------------------------------------------------------------------------------------------------

std::string kind_of(const Message& said) {
  const auto row = std::ranges::find_if(
      kRows, [&](const Row& each) { return std::regex_match(said.what, std::regex(each.pattern)); });
  if (row != kRows.end() && row->kind[0] != '\0') return row->kind;
  static const std::regex kIn(".* in (\\w+)(?: '.*')?(?: \\(id.*\\))?(?: \\d+)?(?:,.*)?$");
  std::smatch parts;
  if (!std::regex_match(said.what, parts, kIn)) return "";
  if (parts[1] == "bodypair") return "exclude";
  if (parts[1] == "collision") return "pair";
  return parts[1];
}

// Of an included file, whose lines MuJoCo does not keep: the first that fits what is said.
bool fits(const DocumentElement& element, const Message& said) {
  static const std::regex kAttribute(".*attribute:? '(.*)'");
  std::smatch parts;
  if (!std::regex_match(said.what, parts, kAttribute)) return true;
  const bool there = element.has(parts[1]);
  if (said.what.starts_with("required attribute missing")) return !there;
  if (!said.what.starts_with("bad format")) return there;
  const std::string value = element.attribute(parts[1]);
  return there && value.find_first_not_of("0123456789.+-eE \t\r\n") != std::string::npos;
}

struct Found {
  const DocumentElement* element = nullptr;
  bool alone = true;  // no other one fits
};

Found find(const Message& said, const std::vector<DocumentElement>& elements) {
  const std::string kind = kind_of(said);
  const auto is_of_kind = [&](const DocumentElement& e) {
    // of sections the elements in them, not they themselves
    const bool is_section = e.section.empty() && e.tag == kind;
    return kind.empty() || (e.tag == kind && !is_section) || e.section == kind || (kind == "body" && e.tag == "link") ||
           (kind == "joint" && e.tag == "freejoint");
  };
  Found found;
  const auto search = [&](const auto& is_it) {
    for (const DocumentElement& element : elements) {
      if (!is_it(element)) continue;
      if (found.element != nullptr) found.alone = false;
      if (found.element == nullptr) found.element = &element;
    }
    return found.element != nullptr;
  };
  if (!said.tag.empty()) {
    const bool own = said.line > 0;
    search([&](const DocumentElement& e) {
      return e.tag == said.tag && e.place.file.empty() == own && (!own || e.place.line == said.line) && fits(e, said);
    }) ||
        search([&](const DocumentElement& e) {
          return e.tag == said.tag && e.place.file.empty() == own && (!own || e.place.line == said.line);
        });
    return found;
  }
  const auto at_line = [&](const DocumentElement& e) { return said.line == 0 || e.place.line == said.line; };
  const auto is_named = [&](const DocumentElement& e) {
    return !e.name.empty() && (e.attached ? said.name.ends_with(e.name) : said.name == e.name);
  };
  if (search([&](const DocumentElement& e) { return at_line(e) && is_of_kind(e) && is_named(e); })) return found;
  if (search([&](const DocumentElement& e) { return at_line(e) && is_named(e); })) return found;
  // of an included file, whose lines MuJoCo does not keep
  if (search([&](const DocumentElement& e) { return is_of_kind(e) && is_named(e); })) return found;
  if (said.line > 0 || !kind.empty()) search([&](const DocumentElement& e) { return at_line(e) && is_of_kind(e); });
  if (said.line == 0 && !found.alone) found.element = nullptr;
  return found;
}

constexpr const char* kLeavesAllOut = "leaves it out with all that is in it";
constexpr const char* kIgnores = "ignores it";

// The message without those words, about the element that they are of.
std::string outer(const std::string& message, std::string_view words) {
  std::string text = message;
  return text.erase(text.find(words), words.size());
}

}  // namespace

Problem xml_problem(const std::string& message) {
  static const std::regex kError("XML_ERROR_(\\w+)");
  std::smatch parts;
  const std::string kind = std::regex_search(message, parts, kError) ? parts[1].str() : "";
  static const std::regex kName("XMLElement name=([^\\s']+)");
  const std::string name = std::regex_search(message, parts, kName) ? parts[1].str() : "";
  Problem problem;
  problem.line = number_after(message, "Line number=");
  const auto say = [&](std::string what, std::string mend) {
    problem.message = std::move(what);
    problem.mend = std::move(mend);
  };
  if (kind == "MISMATCHED_ELEMENT") {
    say(fmt::format("is not XML: the element {}is not closed by an end of its own name",
                    name.empty() ? "that begins there " : fmt::format("<{}> ", name)),
        name.empty() ? "close each element" : fmt::format("write </{0}> after its content, or <{0} .../>", name));
  } else if (kind == "PARSING_ATTRIBUTE") {
    say(fmt::format("is not XML: the element {}has an attribute that is not NAME=\"VALUE\", or one twice",
                    name.empty() ? "there " : fmt::format("<{}> ", name)),
        "put each value in quotes, and give each attribute once");
  } else if (kind == "PARSING_ELEMENT") {
    say("is not XML: a '<' begins no element that ends in '>'", "complete the element, or write &lt; for a '<'");
  } else if (kind == "PARSING_COMMENT") {
    say("is not XML: a comment does not end", "end it with -->");
  } else if (kind == "PARSING_CDATA" || kind == "PARSING_DECLARATION" || kind == "PARSING_UNKNOWN") {
    say("is not XML: a <? or <! does not end", "end it with ?> or >, or remove it");
  } else if (kind == "EMPTY_DOCUMENT") {
    say("holds no XML element", "name an MJCF or URDF file");
    problem.line = 0;
  } else if (kind == "ELEMENT_DEPTH_EXCEEDED") {
    say("has elements in elements more than 100 deep", "put bodies that far apart into fewer levels");
  } else {
    say("is not XML", "correct the XML there");
  }
  return problem;
}

std::optional<Problem> encoding_problem(const std::string& text) {
  using namespace std::string_view_literals;
  const auto begins = [&](std::string_view with) { return text.starts_with(with); };
  Problem problem;
  const auto encoded = [&](const char* encoding) {
    problem.message = fmt::format("is written in {}, and models are read as UTF-8", encoding);
    problem.mend = fmt::format("save it as UTF-8: `iconv -f {} -t UTF-8 OLD > NEW`", encoding);
    return problem;
  };
  if (begins("\xff\xfe\0\0"sv) || begins("\0\0\xfe\xff"sv) || begins("<\0\0\0"sv)) return encoded("UTF-32");
  if (begins("\xff\xfe") || begins("\xfe\xff")) return encoded("UTF-16");
  if (begins("<\0"sv)) return encoded("UTF-16LE");
  if (begins("\0<"sv)) return encoded("UTF-16BE");
  if (begins("PK\x03\x04") || begins("\x1f\x8b")) {
    problem.message = "is an archive";
    problem.mend = "unpack it, and name the MJCF or URDF file in it";
    return problem;
  }
  if (const size_t at = text.find('\0'); at != std::string::npos) {
    const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n');
    problem.message = fmt::format("is a binary file, with a NUL character in line {}", line);
    problem.mend =
        "name the MJCF or URDF file, which is text; a compiled .mjb model has the MJCF file that it was made from";
    return problem;
  }
  return std::nullopt;
}

namespace {

// What has to go first where MuJoCo lacks a plugin: the last element that uses one, with what names it, and at the end
// the <extension>, which MuJoCo reads first.
const DocumentElement* plugin_user(const std::vector<DocumentElement>& elements) {
  const DocumentElement *user = nullptr, *extension = nullptr;
  for (const DocumentElement& element : elements) {
    if (element.tag != "plugin" || element.attached || element.parent < 0) continue;
    const DocumentElement& owner = elements[static_cast<size_t>(element.parent)];
    if (owner.tag == "extension") {
      extension = &owner;
    } else {
      user = owner.tag == "mesh" || owner.tag == "geom" ? &owner : &element;
    }
  }
  if (user == nullptr || user->tag != "mesh") return user == nullptr ? extension : user;
  for (const DocumentElement& element : elements) {
    if (element.tag == "geom" && !element.attached && element.attribute("mesh") == user->name) return &element;
  }
  return user;
}

bool is_deformable(const DocumentElement& element) { return element.tag == "flexcomp" || element.tag == "flex"; }

// The part as what is left out for that reason.
UnknownPart part_of(const DocumentElement& element, const std::string& attribute, const std::string& why,
                    const std::vector<DocumentElement>& elements) {
  UnknownPart unknown;
  unknown.path = element.place.path;
  unknown.part = {.line = element.place.line, .index = 0, .element = element.tag, .attribute = attribute, .value = ""};
  for (const DocumentElement& other : elements) {
    if (&other == &element) break;
    const bool beside = other.tag == element.tag && other.place.line == element.place.line &&
                        other.place.path == element.place.path && !other.attached;
    if (beside) ++unknown.part.index;
  }
  unknown.problem = {
      .severity = Severity::kLeftOut,
      .element = element.label,
      .line = element.place.line,
      .file = element.place.file,
      .message = fmt::format("{}: --drop-unsupported {}", why, attribute.empty() ? kLeavesAllOut : kIgnores)};
  return unknown;
}

}  // namespace

std::optional<UnknownPart> unknown_part(const std::string& message, const std::vector<DocumentElement>& elements) {
  const Message said(message);
  static const std::regex kPlugin("plugin .* not found|unrecognized plugin '.*'");
  if (std::regex_match(said.what, kPlugin)) {
    const DocumentElement* user = plugin_user(elements);
    if (user == nullptr) return std::nullopt;
    return part_of(*user, "",
                   user->tag == "plugin" || user->tag == "extension" ? "is a plugin, which is not supported"
                                                                     : "needs a plugin, which is not supported",
                   elements);
  }
  static const std::regex kAttribute("unrecognized attribute: '(.*)'");
  std::smatch parts;
  const bool attribute = std::regex_match(said.what, parts, kAttribute);
  const bool keyword = said.what.starts_with("invalid keyword");
  const bool deformable = said.tag == "flexcomp" || said.tag == "flex";
  if (said.tag.empty()) return std::nullopt;
  if (!attribute && !keyword && !deformable && said.what != "unrecognized element") return std::nullopt;
  const Found found = find(said, elements);
  if (found.element == nullptr || found.element->attached) return std::nullopt;
  const DocumentElement& element = *found.element;
  if (!attribute && (deformable || keyword)) {
    // a deformable body is left out anyway, whatever is wrong with it
    const DocumentElement* body = &element;
    while (!is_deformable(*body) && body->parent >= 0) body = &elements[static_cast<size_t>(body->parent)];
    if (!is_deformable(*body)) return std::nullopt;
    return part_of(*body, "", "is a deformable body, which is not supported, and cannot be read", elements);
  }
  if (attribute && !element.has(parts[1])) return std::nullopt;
  // of an included file there is no line
  const bool own = element.place.file.empty();
  if (!own && !attribute && !found.alone) return std::nullopt;
  if (!attribute) return part_of(element, "", "is an element that MJCF does not know there", elements);
  return part_of(element, parts[1],
                 fmt::format("has an attribute '{}', which MJCF does not know there", parts[1].str()), elements);
}

Problem parser_problem(const std::string& message, const std::string& text, const std::string& path) {
  if (message.find("XML_ERROR_") != std::string::npos) return xml_problem(message);
  const Message said(message);
  const std::vector<DocumentElement> elements = elements_in(text, path);
  const Found found = find(said, elements);
  constexpr std::string_view kInModel = "could not parse model file with error: ";
  if (said.what.starts_with(kInModel) && found.element != nullptr) {
    const std::string name = found.element->attribute("file");
    const std::string folder = model_folder(path).string(), file = included_file(folder, folder, name);
    if (!file.empty()) {
      std::ifstream stream(file, std::ios::binary);
      const std::string own((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
      const size_t at = message.find(kInModel) + kInModel.size();
      Problem problem = parser_problem(message.substr(at, message.rfind("\nElement '") - at), own, file);
      if (problem.file.empty()) problem.file = name;
      return problem;
    }
  }
  if (said.what.starts_with(kInModel)) return parser_problem(outer(message, kInModel), text, path);
  Problem problem;
  const Words words = words_for(said, found.element);
  problem.message = words.message;
  problem.mend = words.mend;
  if (found.element != nullptr) {
    problem.element =
        found.alone || !found.element->name.empty() ? found.element->label : with_article(found.element->tag);
    problem.line = found.element->place.line;
    problem.file = found.element->place.file;
    if (const auto part = unknown_part(message, elements)) {
      const bool plugin = said.what.find("plugin") != std::string::npos && said.tag != "flexcomp";
      problem.option = fmt::format("--drop-unsupported, which {}", plugin ? "leaves it out with all that uses plugins"
                                                                   : part->part.attribute.empty() ? kLeavesAllOut
                                                                                                  : kIgnores);
    }
  } else {
    problem.element = !said.name.empty()  ? fmt::format("'{}'", said.name)
                      : !said.tag.empty() ? with_article(said.tag)
                                          : "";
    if (problem.element.empty()) problem.message = "it " + problem.message;
    problem.line = said.line;
  }
  return problem;
}

}  // namespace assay
