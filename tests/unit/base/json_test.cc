// Texts that are not UTF-8, and JSON of them.
#include "base/json.h"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace assay {
namespace {

TEST(Json, BytesThatAreNoCharactersAreReplaced) {
  const nlohmann::json robot = {{"name", "caf\xe9"}, {"joints", {"knee", "\xff\xfe"}}};
  EXPECT_THROW(static_cast<void>(robot.dump()), nlohmann::json::exception);
  const nlohmann::json back = nlohmann::json::parse(dump_json(robot));
  EXPECT_EQ(back["name"], "caf\ufffd");
  EXPECT_EQ(back["joints"][0], "knee");
  EXPECT_EQ(back["joints"][1], "\ufffd\ufffd");
  EXPECT_EQ(dump_json(nlohmann::ordered_json{{"b", 1}, {"a", "\xff"}}), "{\"b\":1,\"a\":\"\ufffd\"}");
  EXPECT_EQ(dump_json(nlohmann::json{1}, 1), "[\n 1\n]");
}

TEST(Json, WhatSteersATerminalIsEscaped) {
  // NOLINTNEXTLINE(misc-misleading-bidirectional): that is what it is about
  const std::string name = "4.34 µm \u009b31m\u0085\u202e\u2066\u2028\x7f \U0001f916";
  const std::string text = dump_json(nlohmann::json{{"name", name}});
  EXPECT_EQ(text, "{\"name\":\"4.34 µm \\u009b31m\\u0085\\u202e\\u2066\\u2028\\u007f \U0001f916\"}");
  EXPECT_EQ(nlohmann::json::parse(text)["name"], name);
}

TEST(Json, Utf8IsToldFromOtherBytes) {
  for (const char* text : {"", "plain\n\x1b[", "4.34 µm \u673a \U0001f916", "\u07ff\u0800\uffff\U0010ffff"}) {
    EXPECT_TRUE(is_utf8(text)) << text;
  }
  EXPECT_TRUE(is_utf8(std::string("a\0b", 3)));
  // no first byte, cut, overlong, a surrogate, beyond the last character
  for (const char* text : {"\xff", "\x80", "caf\xe9.xml", "\xc3", "a\xe2\x80", "\xc0\x80", "\xe0\x80\x80",
                           "\xed\xa0\x80", "\xf4\x90\x80\x80", "\xf8\x88\x80\x80\x80"}) {
    EXPECT_FALSE(is_utf8(text)) << testing::PrintToString(std::string(text));
  }
}

}  // namespace
}  // namespace assay
