#include "load/mjcf_document.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <ranges>
#include <set>
#include <sstream>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <tinyxml2.h>

#include "base/errors.h"
#include "base/text.h"
#include "load/inertia.h"
#include "load/outside_files.h"

namespace assay {
namespace {

namespace fs = std::filesystem;
namespace xml = tinyxml2;

std::string text_of(const xml::XMLElement& element, const char* attribute) {
  const char* value = element.Attribute(attribute);
  return value == nullptr ? "" : value;
}

// Empty where one of the words is no number.
std::vector<double> numbers_of(const xml::XMLElement& element, const char* attribute) {
  std::istringstream words(text_of(element, attribute));
  std::vector<double> numbers;
  for (std::string word; words >> word;) {
    const auto number = parse_number(word);
    if (!number || !std::isfinite(*number)) return {};
    numbers.push_back(*number);
  }
  return numbers;
}

std::string written(const std::vector<double>& numbers) {
  std::vector<std::string> words;
  words.reserve(numbers.size());
  for (const double number : numbers) words.push_back(shortest(number));
  return join(words, " ");
}

std::string moments_text(const Vec3& moments) {
  return fmt::format("{:.3g}, {:.3g}, {:.3g}", moments[0], moments[1], moments[2]);
}

// One file of the document: the model's own, or one that it includes.
struct Source {
  std::string name;    // as the <include> writes it; empty for the model's own
  std::string path;    // of an included file
  std::string folder;  // of the file, where MuJoCo looks for what it includes
  std::string text;
  xml::XMLDocument document;
  std::map<std::pair<int, std::string>, int> counted;  // elements of a name that began in a line so far
  std::vector<AttributeEdit> edits;
  struct Include {
    int line = 0, index = 0;
    Source* source = nullptr;
  };
  std::vector<Include> includes;  // in the text's order
};

struct Fault {
  Problem problem;
  Mend mend;
};

class Document {
 public:
  Document(const std::string& text, const std::string& path, std::map<std::string, std::string> texts = {})
      : folder_(model_folder(path)), texts_(std::move(texts)) {
    read("", folder_.string(), text);
  }

  const std::vector<Fault>& faults() const { return faults_; }
  const std::map<std::string, IncludedPlace>& places() const { return places_; }
  const std::map<std::string, std::string>& models() const { return models_; }
  // The paths of what its <include> name; an empty one for what is not there.
  const std::set<std::string>& included() const { return included_; }
  std::vector<DocumentElement> elements() const {
    std::vector<DocumentElement> all;
    for (const auto& source : sources_) describe(*source, *source->document.RootElement(), -1, "", "", all);
    return all;
  }

  // The whole text with the faults mended, to be written into `out`.
  std::string mended(const std::string& out) const {
    const bool moved = model_folder(out) != folder_;
    const bool flat = moved || std::ranges::any_of(sources_, [](const auto& source) {
                        return !source->name.empty() && !source->edits.empty();
                      });
    const Source& own = *sources_.front();
    std::string text = flat ? expanded(own) : edited(own.text, own.edits);
    if (moved) {
      const size_t end = text.rfind("</mujoco");
      if (end != std::string::npos) {
        text.insert(end, fmt::format("  <compiler meshdir=\"{}\" texturedir=\"{}\"/>\n", (folder_ / meshes_).string(),
                                     (folder_ / textures_).string()));
      }
    }
    return text;
  }

 private:
  // `owner`: the body or default class around it, as messages name it.
  static void describe(const Source& source, const xml::XMLElement& element, int parent, const std::string& owner,
                       const std::string& section, std::vector<DocumentElement>& all) {
    const std::string tag = element.Name(), name = text_of(element, "name");
    DocumentElement found = {.tag = tag, .section = section, .name = name, .label = "", .place = {}, .attributes = {}};
    found.place = {source.name, element.GetLineNum(), source.path};
    found.parent = parent;
    for (const xml::XMLAttribute* a = element.FirstAttribute(); a != nullptr; a = a->Next()) {
      found.attributes.emplace_back(a->Name(), a->Value());
    }
    const bool alone = element.Parent() == nullptr || element.Parent()->ToElement() == nullptr || section.empty();
    found.label = !name.empty() ? fmt::format("{} '{}'", tag, name)
                  : alone       ? fmt::format("<{}>", tag)
                                : fmt::format("{}{}", with_article(tag), owner.empty() ? "" : " of " + owner);
    std::string inner = section, next = owner;
    if (tag == "worldbody") next = "the world";
    if (tag == "body" || tag == "link") next = name.empty() ? "a body without a name" : found.label;
    if (tag == "default")
      next = fmt::format("the class '{}'", element.Attribute("class") ? text_of(element, "class") : "main");
    if (is_section(tag)) inner = tag == "worldbody" ? "body" : tag;
    const int own = static_cast<int>(all.size());
    all.push_back(std::move(found));
    for (const xml::XMLElement* e = element.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      describe(source, *e, own, next, inner, all);
    }
  }

  static bool is_section(std::string_view tag) {
    static const std::set<std::string_view> kSections = {"asset",    "contact", "equality", "tendon",
                                                         "actuator", "body",    "sensor",   "keyframe",
                                                         "custom",   "default", "worldbody"};
    return kSections.contains(tag);
  }

  // Null for a file that is missing, no XML, or read already: MuJoCo's parser says so.
  Source* read(const std::string& name, const std::string& folder, const std::string& text,
               const std::string& section = "", const std::string& path = "") {
    auto source = std::make_unique<Source>();
    source->name = name;
    source->path = path;
    source->folder = folder;
    source->text = text;
    source->document.Parse(text.data(), text.size());
    const xml::XMLElement* root = source->document.RootElement();
    if (source->document.Error() || root == nullptr) return nullptr;
    sources_.push_back(std::move(source));
    Source& kept = *sources_.back();
    walk(kept, *root, "", section);
    return &kept;
  }

  // `section` is what the element stands in: "actuator", or "body" for all bodies.
  void walk(Source& source, const xml::XMLElement& element, const std::string& body, const std::string& section) {
    const std::string_view kind = element.Name();
    const int index = source.counted[{element.GetLineNum(), element.Name()}]++;
    std::string owner = body;
    if (kind == "body" || kind == "worldbody") {
      const std::string name = text_of(element, "name");
      owner = kind == "worldbody" ? "the world"
              : name.empty()      ? "a body without a name"
                                  : fmt::format("body '{}'", name);
    } else if (kind == "include") {
      include(source, element, index, section);
      return;
    } else if (kind == "compiler") {
      read_compiler(element);
    } else if (kind == "inertial") {
      examine_inertial(source, element, index, body);
    } else {
      examine_ranges(source, element, index, body);
    }
    if (!source.name.empty()) note_place(source, element, section);
    if (kind == "model" && section == "asset" && element.Attribute("name") != nullptr) {
      models_.emplace(text_of(element, "name"), text_of(element, "file"));
    }
    std::string inner = section;
    if (is_section(kind)) inner = kind == "worldbody" ? "body" : kind;
    for (const xml::XMLElement* e = element.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      walk(source, *e, owner, inner);
    }
  }

  // By the labels that messages use.
  void note_place(const Source& source, const xml::XMLElement& element, const std::string& section) {
    const std::string name = text_of(element, "name"), tag = element.Name();
    if (name.empty()) return;
    const auto note = [&](const std::string& kind) {
      places_.emplace(fmt::format("{} '{}'", kind, name), IncludedPlace{source.name, element.GetLineNum()});
    };
    if (section == "body" || tag == "body") {
      note(tag == "freejoint" ? "joint" : tag);
    } else if (section == "actuator" || section == "tendon") {
      note(section);
    } else if (section == "equality") {
      note(section);
      note(tag == "joint" || tag == "tendon" ? "coupling" : tag);
    } else if (section == "asset" || section == "contact" || section == "keyframe" || section == "custom") {
      note(tag);
    }
  }

  void include(Source& source, const xml::XMLElement& element, int index, const std::string& section) {
    const std::string name = text_of(element, "file");
    const std::string path = included_file(folder_.string(), source.folder, name);
    std::error_code error;
    if (!included_.insert(path).second || !fs::is_regular_file(path, error)) return;
    std::ifstream file(path, std::ios::binary);
    const auto given = texts_.find(path);
    const std::string text =
        given != texts_.end() ? given->second
                              : std::string((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    if (Source* other = read(name, fs::path(path).parent_path().string(), text, section, path)) {
      source.includes.push_back({element.GetLineNum(), index, other});
    }
  }

  void read_compiler(const xml::XMLElement& element) {
    if (const std::string folder = text_of(element, "assetdir"); !folder.empty()) meshes_ = textures_ = folder;
    if (const std::string folder = text_of(element, "meshdir"); !folder.empty()) meshes_ = folder;
    if (const std::string folder = text_of(element, "texturedir"); !folder.empty()) textures_ = folder;
    if (text_of(element, "balanceinertia") == "true" || text_of(element, "inertiafromgeom") == "true") {
      inertia_counts_ = false;  // MuJoCo mends or ignores it
    }
  }

  void add(Source& source, const xml::XMLElement& element, int index, const std::string& what, const std::string& fault,
           const std::string& mended, const char* attribute, const std::string& value) {
    const int line = element.GetLineNum();
    const bool own = source.name.empty();
    Fault result;
    result.problem.element = what;
    result.problem.line = line;
    result.problem.file = source.name;
    result.problem.message = fault;
    result.problem.mend = "correct it, give --repair, or write a mended file with `assay check FILE --repair OUT`";
    result.mend = {own ? line : 0, own ? fmt::format("{}: {}", what, mended)
                                       : fmt::format("{} ({}, line {}): {}", what, source.name, line, mended)};
    faults_.push_back(std::move(result));
    source.edits.push_back({line, index, element.Name(), attribute, value});
  }

  void examine_inertial(Source& source, const xml::XMLElement& element, int index, const std::string& body) {
    if (!inertia_counts_) return;
    const bool full = element.Attribute("fullinertia") != nullptr;
    const char* attribute = full ? "fullinertia" : "diaginertia";
    const std::vector<double> n = numbers_of(element, attribute);
    Mat3 I = Mat3::Zero();
    if (full && n.size() == 6) {
      I << n[0], n[3], n[4], n[3], n[1], n[5], n[4], n[5], n[2];
    } else if (!full && n.size() == 3) {
      I.diagonal() << n[0], n[1], n[2];
    } else {
      return;
    }
    const Vec3 moments = principal_moments(I);
    const xml::XMLElement* owner = element.Parent()->ToElement();
    const bool moves = owner->FirstChildElement("joint") != nullptr || owner->FirstChildElement("freejoint") != nullptr;
    const bool positive = moments[0] > 0 || (!moves && moments[0] == 0);
    const bool triangle = moments[0] + moments[1] >= moments[2];
    const std::vector<double> mass = numbers_of(element, "mass");
    if ((positive && triangle) || mass.size() != 1 || mass[0] <= 0) return;
    const Mat3 mended = nearest_valid_inertia(I, mass[0]);
    std::vector<double> values = {mended(0, 0), mended(1, 1), mended(2, 2)};
    if (full) values.insert(values.end(), {mended(0, 1), mended(0, 2), mended(1, 2)});
    const std::string fault =
        !positive ? "has an inertia that is not positive" : "has an inertia that breaks the triangle inequality";
    add(source, element, index, body, fmt::format("{} (principal moments {} kg m^2)", fault, moments_text(moments)),
        fmt::format("principal moments of its inertia {} -> {} kg m^2", moments_text(moments),
                    moments_text(principal_moments(mended))),
        attribute, written(values));
  }

  // Bounds in the wrong order, of an element or of a default.
  void examine_ranges(Source& source, const xml::XMLElement& element, int index, const std::string& body) {
    for (const char* attribute : {"range", "ctrlrange", "forcerange", "actrange", "actuatorfrcrange", "lengthrange"}) {
      const std::vector<double> n = numbers_of(element, attribute);
      if (n.size() != 2 || n[0] <= n[1]) continue;
      const std::string name = text_of(element, "name"), is = written(n), swapped = written({n[1], n[0]});
      const std::string what = name.empty() ? fmt::format("a {}{}", element.Name(), body.empty() ? "" : " of " + body)
                                            : fmt::format("{} '{}'", element.Name(), name);
      add(source, element, index, what, fmt::format("has {}=\"{}\", whose bounds are swapped", attribute, is),
          fmt::format("{} {} -> {}", attribute, is, swapped), attribute, swapped);
    }
  }

  // The mended text of a source with what it includes in place.
  static std::string expanded(const Source& source) {
    std::string text = edited(source.text, source.edits);
    // from the end, so that what comes before keeps its line
    for (const Source::Include& include : std::views::reverse(source.includes)) {
      const size_t begin = element_begin(text, include.line, include.index, "include");
      if (begin == std::string::npos) continue;
      size_t end = tag_end(text, begin);
      if (text[end - 1] != '/') end = text.find('>', text.find("</include", end));
      text.replace(begin, end + 1 - begin,
                   inside(expanded(*include.source), include.source->document.RootElement()->Name()));
    }
    return text;
  }

  // What stands between the tags of the root element.
  static std::string inside(const std::string& text, const std::string& root) {
    const size_t open = tag_end(text, element_begin(text, 1, 0, root));
    const size_t close = text.rfind("</" + root);
    return open == text.size() || text[open - 1] == '/' || close == std::string::npos
               ? ""
               : text.substr(open + 1, close - open - 1);
  }

  fs::path folder_;
  std::map<std::string, std::string> texts_;  // of included files, in place of the files'
  std::vector<std::unique_ptr<Source>> sources_;
  std::set<std::string> included_;
  std::vector<Fault> faults_;
  std::map<std::string, IncludedPlace> places_;  // in included files
  std::map<std::string, std::string> models_;    // name -> file
  std::string meshes_, textures_;                // folders of files, from the model's
  bool inertia_counts_ = true;
};

// Calls `work` with the name, the text and the path of each model that is an asset. A model that contains itself is
// refused before (outside_files.h).
template <typename Work>
void in_models(const Document& document, const std::string& path, const Work& work) {
  const std::string folder = model_folder(path).string();
  for (const auto& [asset, name] : document.models()) {
    const std::string file = included_file(folder, folder, name);
    std::error_code error;
    if (file.empty() || !fs::is_regular_file(file, error)) continue;
    std::ifstream stream(file, std::ios::binary);
    work(name, std::string((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>()), file);
  }
}

}  // namespace

std::string DocumentPlaces::file_of_model(const std::string& name) const {
  const auto found = models.find(name);
  return found == models.end() || name.empty() ? name : found->second;
}

DocumentPlaces places_in(const std::string& text, const std::string& path) {
  if (text.find("<include") == std::string::npos && text.find("<model") == std::string::npos) return {};
  const Document document(text, path);
  return {document.places(), document.models()};
}

std::vector<std::string> included_files(const std::string& text, const std::string& path) {
  if (text.find("<include") == std::string::npos) return {};
  const Document document(text, path);
  std::vector<std::string> files(document.included().begin(), document.included().end());
  std::erase(files, "");
  return files;
}

std::string with_article(const std::string& tag) {
  const bool vowel = !tag.empty() && std::string_view("aeiou").find(tag.front()) != std::string_view::npos;
  return (vowel ? "an " : "a ") + tag;
}

bool DocumentElement::has(const std::string& key) const {
  return std::ranges::find(attributes, key, &std::pair<std::string, std::string>::first) != attributes.end();
}

std::string DocumentElement::attribute(const std::string& key) const {
  const auto found = std::ranges::find(attributes, key, &std::pair<std::string, std::string>::first);
  return found == attributes.end() ? "" : found->second;
}

std::vector<DocumentElement> elements_in(const std::string& text, const std::string& path,
                                         const std::map<std::string, std::string>& texts) {
  const Document document(text, path, texts);
  std::vector<DocumentElement> elements = document.elements();
  in_models(document, path, [&](const std::string& name, const std::string& model, const std::string& file) {
    for (DocumentElement& element : elements_in(model, file)) {
      if (element.place.file.empty()) element.place.file = name;
      element.attached = true;
      elements.push_back(std::move(element));
    }
  });
  return elements;
}

std::vector<Problem> mjcf_faults(const std::string& text, const std::string& path) {
  const Document document(text, path);
  std::vector<Problem> problems;
  problems.reserve(document.faults().size());
  for (const Fault& fault : document.faults()) problems.push_back(fault.problem);
  in_models(document, path, [&](const std::string& name, const std::string& model, const std::string& file) {
    for (Problem& problem : mjcf_faults(model, file)) {
      if (problem.file.empty()) problem.file = name;
      problem.mend = fmt::format("correct it, give --repair, or write a mended file with `assay check {} --repair OUT`",
                                 problem.file);
      problems.push_back(std::move(problem));
    }
  });
  return problems;
}

std::map<std::string, std::string> mended_assets(const std::string& text, const std::string& path,
                                                 std::vector<Mend>& mends) {
  std::map<std::string, std::string> mended;
  if (text.find("<model") == std::string::npos) return mended;
  in_models(Document(text, path), path,
            [&](const std::string& name, const std::string& model, const std::string& file) {
              std::vector<Mend> own;
              const std::string without_faults = mend_mjcf(model, file, file, own);
              mended.merge(mended_assets(model, file, mends));
              if (own.empty()) return;
              mended.emplace(file, without_faults);
              for (const Mend& mend : own) {
                const std::string at = mend.line > 0 ? fmt::format("{}, line {}", name, mend.line) : name;
                mends.push_back({0, fmt::format("{} ({})", mend.what, at)});
              }
            });
  return mended;
}

std::string mend_mjcf(const std::string& text, const std::string& path, const std::string& out,
                      std::vector<Mend>& mends) {
  const Document document(text, path);
  for (const Fault& fault : document.faults()) mends.push_back(fault.mend);
  return mends.empty() ? text : document.mended(out);
}

}  // namespace assay
