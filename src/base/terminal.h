// The terminal behind a stream: how wide it is, whether it shows colour, and text made fit for it.
#pragma once

#include <cstddef>
#include <cstdio>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace assay {

// Columns of the terminal that `stream` writes to: as the terminal says, else as COLUMNS says, else 80. Empty when the
// stream is a file or a pipe.
std::optional<size_t> terminal_columns(std::FILE* stream);

// Whether text on `stream` gets colour: on a terminal other than "dumb", or anywhere when CLICOLOR_FORCE is set.
// NO_COLOR switches it off everywhere.
bool has_color(std::FILE* stream);

enum class Style : char { kHeading = 'h', kGood = 'g', kWarning = 'w', kBad = 'b' };

// `text` between marks that terminal_text() turns into colour or weight. The marks begin with a NUL and a control
// character, which stand in no text that is meant to be read. Styles do not nest.
std::string styled(std::string_view text, Style style);

// `text` on one line with control characters, invalid UTF-8 and direction overrides as escapes ("\x1b"), so that no
// name can steer the terminal. Marks of styled() stay.
std::string printable(std::string_view text);

// Lines of `text` as they are written to `stream`: each made printable, with colour where has_color().
std::string terminal_text(std::string_view text, std::FILE* stream);

// Columns that a line takes: wide characters count two; combining ones and marks of styled() none.
size_t display_width(std::string_view line);

// `line` in at most `columns` columns, with an ellipsis where it was cut.
std::string clipped(std::string_view line, size_t columns);

// `text` in lines of at most `columns` columns, broken between words; a longer word is broken anywhere. A number stays
// with its unit. `indent` spaces begin every line but the first. At least one line.
std::vector<std::string> wrapped(std::string_view text, size_t columns, size_t indent = 0);

// Columns of the longest part of `text` that wrapped() breaks only where nothing else fits.
size_t longest_word(std::string_view text);

}  // namespace assay
