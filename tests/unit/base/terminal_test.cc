#include "base/terminal.h"

#include <cstdio>
#include <cstdlib>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace assay {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

TEST(Terminal, WidthCountsColumnsAndNotBytes) {
  EXPECT_EQ(display_width("chain"), 5);
  EXPECT_EQ(display_width("4.34 µm"), 7);
  EXPECT_EQ(display_width("\u673a\u5668"), 4);  // two wide characters
  EXPECT_EQ(display_width("e\u0301"), 1);       // an accent takes no column of its own
  EXPECT_EQ(display_width(styled("exact", Style::kGood)), 5);
}

TEST(Terminal, NothingSteersTheTerminal) {
  EXPECT_EQ(printable("a\x1b[2Jb\n\tc\x7f"), "a\\x1b[2Jb\\n\\tc\\x7f");
  EXPECT_EQ(printable("\xc2\x9b"), "\\u009b");        // the one-character form of an escape sequence
  const std::string turn = {'\xe2', '\x80', '\xae'};  // U+202E turns the writing direction
  EXPECT_EQ(printable(turn), "\\u202e");
  // the endings and headings of styles are longer
  EXPECT_EQ(printable(std::string("ball\0.xml\0h\0", 12)), "ball\\x00.xml\\x00h\\x00");
  EXPECT_EQ(printable("a\xff z\xc3"), "a\\xff z\\xc3");  // no UTF-8
  EXPECT_EQ(printable("4.34 µm \u673a"), "4.34 µm \u673a");
  EXPECT_EQ(display_width("\x1b"), 4);  // as it is shown
}

TEST(Terminal, LinesFitAndKeepWordsWhole) {
  EXPECT_THAT(wrapped("soft constraints: bodies sink in", 16), ElementsAre("soft", "constraints:", "bodies sink in"));
  EXPECT_THAT(wrapped("  one two three", 9, 4), ElementsAre("  one two", "    three"));
  EXPECT_THAT(wrapped("short", 80), ElementsAre("short"));
  EXPECT_THAT(wrapped("", 80), ElementsAre(""));
  EXPECT_THAT(wrapped("aaaaaaaaaa bb", 4), ElementsAre("aaaa", "aaaa", "aa", "bb"));
  EXPECT_EQ(longest_word("soft constraints: bodies"), 12);
}

TEST(Terminal, NumberStaysWithItsUnit) {
  EXPECT_THAT(wrapped("an error of 4.34 mm at most", 16), ElementsAre("an error of", "4.34 mm at most"));
  EXPECT_EQ(longest_word("a 120 kHz"), 7);
}

TEST(Terminal, StyleEndsWithItsLine) {
  const auto lines = wrapped(styled("refused here", Style::kBad), 8);
  EXPECT_THAT(lines, ElementsAre(styled("refused", Style::kBad), styled("here", Style::kBad)));
}

TEST(Terminal, ClippedTextSaysThatItWasCut) {
  EXPECT_EQ(clipped("timing: chain", 13), "timing: chain");
  EXPECT_EQ(clipped("timing: chain", 8), "timing:…");
  EXPECT_EQ(display_width(clipped("\u673a\u5668\u4eba", 4)), 3);  // half a wide character does not fit
  EXPECT_EQ(clipped("chain", 0), "");
}

TEST(Terminal, FileHasNeitherColumnsNorColour) {
  std::FILE* file = std::tmpfile();
  ASSERT_NE(file, nullptr);
  EXPECT_EQ(terminal_columns(file), std::nullopt);
  const std::string text = styled("exact", Style::kGood) + "\na\x1b";
  EXPECT_EQ(terminal_text(text + "\n", file), "exact\na\\x1b\n");
  setenv("CLICOLOR_FORCE", "1", 1);
  EXPECT_THAT(terminal_text(text, file), HasSubstr("\x1b[32mexact\x1b[0m"));
  setenv("NO_COLOR", "1", 1);
  EXPECT_THAT(terminal_text(text, file), Not(HasSubstr("\x1b")));
  unsetenv("NO_COLOR");
  unsetenv("CLICOLOR_FORCE");
  std::fclose(file);
}

}  // namespace
}  // namespace assay
