#include "results/export/npz.h"

#include <array>
#include <bit>
#include <cassert>
#include <cstdint>
#include <cstring>

#include <boost/locale/utf.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <zip.h>

#include "base/errors.h"

namespace assay {
namespace {

static_assert(std::endian::native == std::endian::little, "the files say that they are little-endian");

// https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html, version 1.0
std::string npy(const std::string& type, const std::vector<size_t>& shape, std::string_view data) {
  constexpr size_t kPrefix = 10, kAlignment = 64;
  std::string header = fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}{}), }}", type,
                                   fmt::join(shape, ", "), shape.size() == 1 ? "," : "");
  header.append(kAlignment - 1 - (kPrefix + header.size()) % kAlignment, ' ');
  header += '\n';
  std::string out = "\x93NUMPY";
  out += '\1';
  out += '\0';
  out += static_cast<char>(header.size() & 0xff);
  out += static_cast<char>(header.size() >> 8);
  return out.append(header).append(data);
}

std::u32string decode(const std::string& text) {
  using Utf8 = boost::locale::utf::utf_traits<char>;
  std::u32string out;
  for (auto at = text.begin(); at != text.end();) {
    const auto code = Utf8::decode(at, text.end());
    const bool fine = code != boost::locale::utf::illegal && code != boost::locale::utf::incomplete;
    out += fine ? static_cast<char32_t>(code) : U'\ufffd';
  }
  return out;
}

struct Discard {
  void operator()(zip_t* archive) const { zip_discard(archive); }
};

}  // namespace

void Npz::add(const std::string& name, const std::vector<size_t>& shape, const std::vector<double>& values) {
  size_t count = 1;
  for (const size_t length : shape) count *= length;
  assert(count == values.size());
  std::string data(count * sizeof(double), '\0');
  if (!values.empty()) std::memcpy(data.data(), values.data(), data.size());
  entries_.push_back({name, npy("<f8", shape, data)});
}

void Npz::add(const std::string& name, const std::vector<std::string>& texts) {
  std::vector<std::u32string> decoded;
  decoded.reserve(texts.size());
  size_t longest = 1;
  for (const std::string& text : texts) {
    decoded.push_back(decode(text));
    longest = std::max(longest, decoded.back().size());
  }
  std::string data(texts.size() * longest * sizeof(char32_t), '\0');
  for (size_t i = 0; i < decoded.size(); ++i) {
    if (decoded[i].empty()) continue;
    std::memcpy(data.data() + i * longest * sizeof(char32_t), decoded[i].data(), decoded[i].size() * sizeof(char32_t));
  }
  entries_.push_back({name, npy(fmt::format("<U{}", longest), {texts.size()}, data)});
}

void Npz::write(const std::string& path) const {
  int code = 0;
  std::unique_ptr<zip_t, Discard> archive(zip_open(path.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &code));
  if (!archive) {
    zip_error_t error;
    zip_error_init_with_code(&error, code);
    const std::string why = zip_error_strerror(&error);
    zip_error_fini(&error);
    throw SystemError(fmt::format("cannot write '{}': {}", path, why));
  }
  const auto check = [&](bool fine) {
    if (!fine) throw SystemError(fmt::format("cannot write '{}': {}", path, zip_strerror(archive.get())));
  };
  for (const Entry& entry : entries_) {
    zip_source_t* source = zip_source_buffer(archive.get(), entry.bytes.data(), entry.bytes.size(), 0);
    check(source != nullptr);
    const auto index = zip_file_add(archive.get(), (entry.name + ".npy").c_str(), source, ZIP_FL_ENC_UTF_8);
    if (index < 0) zip_source_free(source);
    check(index >= 0);
    // The first day that the format knows, so that the bytes do not depend on the clock.
    constexpr zip_uint16_t kFirstDay = (1 << 5) | 1;
    check(zip_file_set_dostime(archive.get(), static_cast<zip_uint64_t>(index), 0, kFirstDay, 0) == 0);
  }
  check(zip_close(archive.get()) == 0);
  archive.release();  // NOLINT(bugprone-unused-return-value): zip_close() has freed it
}

}  // namespace assay
