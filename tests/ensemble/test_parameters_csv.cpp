#include "adapters/ensemble/ensemble_toml.hpp"
#include "tests/support/files.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"

#include <doctest/doctest.h>

#include <cmath>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::io;
using namespace lbea::test;

namespace {

ParameterTable read_table(const std::string& text) {
  const TemporaryFolder folder;
  return read_parameters_csv(put(folder / "p.csv", text));
}

void check_refused(const std::string& text, const std::string& words) {
  CAPTURE(text);
  check_error(error_of([&] { (void)read_table(text); }), Status::bad_input, {"p.csv, line ", words});
}

using Words = std::vector<std::string>;

}  // namespace

TEST_CASE("names, units, rows") {
  const ParameterTable table = read_table("run,t_front [mm],mu [-],count\nrun_1,1.5,-2e-3,+7\nrun_2,0,1,2\n");
  CHECK(table.names == Words{"t_front", "mu", "count"});
  CHECK(table.units == Words{"mm", "-", ""});
  CHECK(table.runs == Words{"run_1", "run_2"});
  CHECK(table.values == std::vector<double>{1.5, -2e-3, 7, 0, 1, 2});
  REQUIRE(table.row("run_2").has_value());
  CHECK(table.row("run_2")->size() == 3);
  CHECK((*table.row("run_2"))[2] == 2);
  CHECK_FALSE(table.row("run_3").has_value());
}

TEST_CASE("tables of 0 rows and of 0 parameters") {
  CHECK(read_table("run,a\n").runs.empty());
  CHECK(read_table("run,a\n").names == Words{"a"});
  const ParameterTable bare = read_table("run\nrun_1\n");
  CHECK(bare.names.empty());
  REQUIRE(bare.row("run_1").has_value());
  CHECK(bare.row("run_1")->empty());
}

TEST_CASE("missing values") {
  const ParameterTable table = read_table("run,a,b,c,d,e\nx,,nan,NA,-, \n");
  REQUIRE(table.values.size() == 5);
  for (const double value : table.values) CHECK(std::isnan(value));
}

TEST_CASE("other separators, the decimal comma, quotes, blanks, comments, line ends, a byte order mark") {
  CHECK(read_table("run;a\nx;1,5\n").values == std::vector<double>{1.5});
  CHECK(read_table("run\ta\nx\t1,5\n").values == std::vector<double>{1.5});
  CHECK(read_table("run;a\nx;1.5\n").values == std::vector<double>{1.5});
  CHECK(read_table("\xef\xbb\xbf# made today\r\nrun , a [m/s] \r\n\r\n x , 1.5 \r\n").values ==
        std::vector<double>{1.5});
  const ParameterTable quoted = read_table("\"run\",\"a, b [mm]\"\n\"run, one\",\"1.5\"\n");
  CHECK(quoted.names == Words{"a, b"});
  CHECK(quoted.units == Words{"mm"});
  CHECK(quoted.runs == Words{"run, one"});
}

TEST_CASE("what is no table is refused with its line") {
  check_refused("", "no line of names");
  check_refused("# nothing\n", "no line of names");
  check_refused("run,a\nx,1\ny\n", "line 3: 1 fields where the names are 2");
  check_refused("run,a\nx,1,2\n", "line 2: 3 fields");
  check_refused("run,a\nx,one\n", "line 2: \"one\" in column \"a\"");
  check_refused("run,a\nx,1.5mm\n", "line 2");
  check_refused("run,a\nx,inf\n", "line 2");
  check_refused("run;a\nx;1.000,5\n", "line 2");
  check_refused("run,a\nx,1\nx,2\n", "line 3: a second row for run \"x\"");
  check_refused("run,a\n,1\n", "no run name");
  check_refused("run,a,a\n", "line 1: two columns");
  check_refused("run,[mm]\n", "column 2 has no name");
  CHECK(error_of([] { (void)read_parameters_csv("/nowhere/p.csv"); }).status == Status::file_not_found);
}

TEST_CASE("UTF-16 is named") {
  std::string wide = "\xff\xfe";
  for (const char c : std::string("run;t\nA;1\n")) wide += {c, '\0'};
  check_error(error_of([&] { (void)read_table(wide); }), Status::unsupported_input, {"p.csv: the text is in UTF-16"});
}
