// Names of a model with terminal codes, as programs print and log them.
#include "tests/support/program.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/synthetic_model.hpp"
#include "tools/shared/text/printable.hpp"

#include <doctest/doctest.h>

using namespace lbea::tool;
using namespace lbea::test;

TEST_CASE("control characters are escaped, other text is unchanged") {
  CHECK(printable("run_1, \u00FC, \u03B1, \U0001F697, \"q\" \\") == "run_1, \u00FC, \u03B1, \U0001F697, \"q\" \\");
  CHECK(printable("a\x1b[2J\r\n\t\x7f") == "a\\x1b[2J\\x0d\\x0a\\x09\\x7f");
  CHECK(printable("a\nb\t", "\n") == "a\nb\\x09");
  CHECK(printable("\u009B31m") == "\\xc2\\x9b31m");       // CSI as one character
  CHECK(printable("\u202Eabc") == "\\xe2\\x80\\xaeabc");  // writes from right to left
  // Not UTF-8: a byte of a sequence alone, a cut sequence, an overlong slash, a surrogate, beyond the last character.
  for (const char* bytes : {"\x9b", "\xe2\x80", "\xc0\xaf", "\xed\xa0\x80", "\xf4\x90\x80\x80", "\xff"})
    CHECK_MESSAGE(printable(bytes).starts_with("\\x"), bytes);
  CHECK(printable(std::string_view("\0", 1)) == "\\x00");
  CHECK(printable("").empty());
}

// Regression: a simulation's name could set the terminal's title and clear its screen.
TEST_CASE("a simulation's name does not send control characters to the terminal") {
  const TemporaryFolder folder;
  Ensemble ensemble = bent_plates();
  ensemble.runs[0].name = "\x1b]0;OWNED\x07\x1b[2J";
  ensemble.parameter_names[0] = "angle\x1b[5m [rad]";
  static_cast<void>(bake_model(ensemble, bent_plates_description(), folder / "plates.lbea"));
  for (const char* arguments : {" plates.lbea", " plates.lbea\x1b[31m"}) {
    const Outcome outcome = run_program(LBEA_INSPECT + std::string(arguments), folder.path());
    CAPTURE(outcome.err);
    CHECK(outcome.out.find('\x1b') == std::string::npos);
    CHECK(outcome.err.find('\x1b') == std::string::npos);
    CHECK(contains(outcome.out + outcome.err, "\\x1b["));
  }
}
