#include "base/quantity.h"

#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"

namespace assay {
namespace {

using testing::HasSubstr;

std::string complaint(std::string_view text, std::string_view unit) {
  try {
    parse_quantity("--error", text, unit);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Quantity, IsWrittenWithThreeDigitsAndAPrefix) {
  EXPECT_EQ(quantity_text(0.00434, "m"), "4.34 mm");
  EXPECT_EQ(quantity_text(1.35, "m"), "1.35 m");
  EXPECT_EQ(quantity_text(0, "m"), "0 m");
  EXPECT_EQ(quantity_text(0.9999, "m"), "1.00 m");  // rounds into the next prefix
  EXPECT_EQ(quantity_text(-2.5e-7, "J", 2), "−250 nJ");
  EXPECT_EQ(quantity_text(12.5, "us"), "12.5 µs");
  EXPECT_EQ(quantity_text(1030, "kHz"), "1.03 MHz");
  EXPECT_EQ(quantity_text(3.2e-21, "J"), "3.20\u2009×\u200910⁻²¹ J");
  EXPECT_EQ(quantity_text(2.1e-6, "kg m^2/s"), "2.10\u2009×\u200910⁻⁶ kg m²/s");
  EXPECT_EQ(quantity_text(std::numeric_limits<double>::infinity(), "m"), "–");
}

TEST(Quantity, BelowWhatRoundingLeavesIsSaidToBeBelow) {
  EXPECT_EQ(quantity_text(5e-16, "m"), "below 1 pm");
  EXPECT_EQ(quantity_text(-9.9e-13, "rad"), "below 1 prad");
  EXPECT_EQ(quantity_text(least_quantity("m"), "m"), "1.00 pm");
  EXPECT_EQ(quantity_text(0, "rad"), "0 rad");
  EXPECT_EQ(quantity_text(5e-16, "J"), "500\u2009×\u200910⁻¹⁸ J");  // no floor is known of energies
}

TEST(Quantity, NumbersWithoutUnit) {
  EXPECT_EQ(quantity_text(0.25, "1"), "0.250");
  EXPECT_EQ(number_text(123456), "123\u2009000");
  EXPECT_EQ(number_text(1234), "1230");
  EXPECT_EQ(number_text(1.234e6), "1.23\u2009×\u200910⁶");
  EXPECT_EQ(number_text(2.5, 1), "3");  // a tie goes up
  EXPECT_EQ(realtime_text(638.4), "638×");
}

TEST(Quantity, IsReadInUnitsOfItsKind) {
  EXPECT_DOUBLE_EQ(parse_quantity("--error", "1mm", "m"), 1e-3);
  EXPECT_DOUBLE_EQ(parse_quantity("--error", "2.5 µm", "m"), 2.5e-6);
  EXPECT_DOUBLE_EQ(parse_quantity("--error", "1e-3m", "m"), 1e-3);
  EXPECT_DOUBLE_EQ(parse_quantity("--error", "180deg", "rad"), 3.141592653589793);
  EXPECT_DOUBLE_EQ(parse_quantity("--error", "2%", "1"), 0.02);
  EXPECT_DOUBLE_EQ(parse_quantity("--error", "0.5", "1"), 0.5);
  EXPECT_DOUBLE_EQ(parse_quantity("--error", "3 kg m/s", "kg m/s"), 3);
  EXPECT_DOUBLE_EQ(parse_quantity("--error", "0mm", "m"), 0);
}

TEST(Quantity, RefusalsNameTheUnits) {
  EXPECT_EQ(complaint("1", "m"), "--error is '1': add a unit (mm, µm, um, nm, cm, m), as in 1mm");
  EXPECT_THAT(complaint("1J", "m"), HasSubstr("'J' is no unit of it; use mm, "));
  EXPECT_THAT(complaint("mm", "m"), HasSubstr("give a number with a unit (mm, "));
  EXPECT_THAT(complaint("-1mm", "m"), HasSubstr("not negative"));
  EXPECT_THAT(complaint("", "m"), HasSubstr("give a number with a unit"));
  EXPECT_THAT(complaint("1mm", "1"), HasSubstr("use %, a plain number"));
}

// Everything that is written without a power of ten reads back, for there is one table of units.
TEST(Quantity, WrittenInAUnitThatCanBeGiven) {
  for (const InputUnit& unit : input_units("m")) {
    EXPECT_DOUBLE_EQ(parse_quantity("it", "3" + unit.text, "m"), 3 * unit.scale);
  }
}

}  // namespace
}  // namespace assay
