#include "check/dataset/junit.h"

#include <algorithm>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <tinyxml2.h>

#include "base/terminal.h"
#include "base/text.h"

namespace assay::dataset {
namespace {

bool is_error(const Record& record) {
  return record.kind == kinds::kCrashed || record.kind == kinds::kTimeLimit || record.kind == kinds::kUnreadable;
}

std::vector<const Record*> failing_of(const Report& report, const FileReport& file) {
  std::vector<const Record*> failing;
  for (const Record& record : file.records) {
    if (report.fails(record)) failing.push_back(&record);
  }
  return failing;
}

bool has_error(const std::vector<const Record*>& records) {
  return std::ranges::any_of(records, [](const Record* record) { return is_error(*record); });
}

}  // namespace

std::string junit_text(const Report& report) {
  size_t failures = 0, errors = 0;
  for (const FileReport& file : report.files) {
    const auto failing = failing_of(report, file);
    if (!failing.empty()) ++(has_error(failing) ? errors : failures);
  }
  // XML has no place for control characters, which names may hold
  tinyxml2::XMLPrinter xml;
  xml.PushHeader(false, true);
  xml.OpenElement("testsuite");
  xml.PushAttribute("name", printable("assay check " + report.folder).c_str());
  xml.PushAttribute("tests", std::to_string(report.files.size()).c_str());
  xml.PushAttribute("failures", std::to_string(failures).c_str());
  xml.PushAttribute("errors", std::to_string(errors).c_str());
  for (const FileReport& file : report.files) {
    const size_t slash = file.file.rfind('/', file.file.size() - 2);
    xml.OpenElement("testcase");
    xml.PushAttribute("classname", printable(slash == std::string::npos ? "." : file.file.substr(0, slash)).c_str());
    xml.PushAttribute("name", printable(slash == std::string::npos ? file.file : file.file.substr(slash + 1)).c_str());
    const auto failing = failing_of(report, file);
    if (!failing.empty()) {
      const Record& first = *failing.front();
      xml.OpenElement(has_error(failing) ? "error" : "failure");
      xml.PushAttribute("type", first.kind.c_str());
      xml.PushAttribute("message",
                        printable(failing.size() == 1 ? first.message
                                                      : fmt::format("{}, the first: {}",
                                                                    counted(failing.size(), "finding"), first.message))
                            .c_str());
      std::string lines;
      for (const Record* record : failing) {
        std::string place = record->file.empty() ? file.file : record->file;
        if (record->line > 0) place += fmt::format(":{}", record->line);
        lines +=
            printable(fmt::format("{}: {} ({}): {}", place, rank_text(record->rank), record->kind, record->message)) +
            "\n";
      }
      xml.PushText(lines.c_str());
      xml.CloseElement();
    }
    xml.CloseElement();
  }
  xml.CloseElement();
  return xml.CStr();
}

}  // namespace assay::dataset
