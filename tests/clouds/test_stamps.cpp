#include "adapters/clouds/point_cloud.hpp"
#include "tests/support/files.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"

#include <doctest/doctest.h>

using namespace lbea;
using namespace lbea::io;
using namespace lbea::test;

TEST_CASE("stamps in names, exact to the nanosecond") {
  CHECK(stamp_in_name("cloud_1000050ns") == 1'000'050);
  CHECK(stamp_in_name("run3-left-12.5ms") == 12'500'000);
  CHECK(stamp_in_name("a_0.000000001s") == 1);
  CHECK(stamp_in_name("00017_250us") == 250'000);
  CHECK(stamp_in_name("frame_t0.0125") == 12'500'000);
  CHECK(stamp_in_name("frame_t=3") == 3'000'000'000);
  CHECK(stamp_in_name("1403636579763555584") == 1'403'636'579'763'555'584);
  CHECK(stamp_in_name("1403636579.763555584") == 1'403'636'579'763'555'584);
  CHECK(stamp_in_name("1403636579763") == 1'403'636'579'763'000'000);
  CHECK(stamp_in_name("0007_1403636579763555") == 1'403'636'579'763'555'000);
}

TEST_CASE("other numbers in names are no stamps") {
  for (const char* name : {"frame_000123", "scan12", "run_013_step02", "v1.5", "left", "", "t", "shot3", "12start",
                           "20221121_143000", "v1.2.3", "99999999999999999999s"}) {
    CAPTURE(name);
    CHECK_FALSE(stamp_in_name(name).has_value());
  }
}

TEST_CASE("a table's stamps go before the file's, and these before the name's") {
  const TemporaryFolder folder;
  const CloudStamps table(put(folder / "stamps.csv", "frame;file;time [ms]\n1; clouds/a.ply; 0.5\n2; \"b\"; -2\n\n"));
  CHECK(table.of("x/a.ply", 7) == 500'000);
  CHECK(table.of("b.pcd", std::nullopt) == -2'000'000);
  CHECK(CloudStamps().of("c_9ns.pcd", 7) == 7);
  CHECK(CloudStamps().of("c_9ns.pcd", std::nullopt) == 9);
  CHECK_FALSE(CloudStamps().of("c.pcd", std::nullopt).has_value());
  CHECK(CloudStamps(put(folder / "t.txt", "# filename stamp_ns\na.pcd 123\n")).of("a.pcd", {}) == 123);
  CHECK(CloudStamps(put(folder / "t.csv", "timestamp_us,name\r\n1.5,a\r\n")).of("a.pcd", {}) == 1500);
  const CloudStamps remarked(
      put(folder / "r.csv", "# file,t_ns\n# the first test\na.pcd,9223372036854775807\n\n#a.pcd,1\n"));
  CHECK(remarked.of("a.pcd", {}) == 9'223'372'036'854'775'807);
}

// Regression: such a cloud took its own stamp, from another clock than the table's, in the middle of a test.
TEST_CASE("a cloud that the table lacks is refused, and so are two times for one") {
  const TemporaryFolder folder;
  const CloudStamps table(put(folder / "stamps.csv", "file,stamp_ns\na.ply,1\na.ply,1\n"));
  check_error(error_of([&] { static_cast<void>(table.of("x/c_9ns.pcd", 7)); }), Status::bad_input,
              {"c_9ns.pcd", "table of stamps"});
  const auto twice = put(folder / "twice.csv", "file,stamp_ns\na.ply,1\na.ply,2\n");
  check_error(error_of([&] { CloudStamps{twice}; }), Status::bad_input, {"line 3", "a.ply"});
}

TEST_CASE("a table that says too little is refused with the line") {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& text, const std::vector<std::string>& words) {
    const auto file = put(folder / "stamps.csv", text);
    check_error(error_of([&] { CloudStamps{file}; }), Status::bad_input, words);
  };
  refused("", {"stamps.csv", "empty"});
  refused("file,timestamp\na,1\n", {"line 1", "stamp_ns"});
  refused("file,stamp_ns\na\n", {"line 2", "too few"});
  refused("file,stamp_ns\na,soon\n", {"line 2", "soon"});
  for (const char* none : {"99999999999999999999", "9223372036.9", "1.2.3", "1e3", "-", "."})
    refused(std::string("file,stamp_s\na,") + none + "\n", {"line 2", "not a time"});
  refused("file,stamp_ns\na,9223372036854775808\n", {"line 2", "not a time"});
  CHECK(error_of([&] { CloudStamps{folder / "none.csv"}; }).status == Status::file_not_found);
}

TEST_CASE("a file's name tells whether it is a cloud, or text that may also be a table about clouds") {
  for (const char* name : {"a.ply", "folder.d/b.pcd", "c.stl"}) CHECK(cloud_name(name) == CloudName::cloud);
  for (const char* name : {"a.xyz", "b.txt", "c.csv", "d.asc"}) CHECK(cloud_name(name) == CloudName::text);
  for (const char* name : {"ply", "a.plyx", "a.pl", "a.ply.bak", ".ply", "a.", "a"})
    CHECK(cloud_name(name) == CloudName::none);
  CHECK(cloud_extensions() == ".ply .pcd .stl .xyz .txt .csv .asc");
}

TEST_CASE("a table as Excel saves it: with a byte order mark; in UTF-16 it is named") {
  const TemporaryFolder folder;
  const std::string text = "file,stamp_ms\na.xyz,1.5\n";
  CHECK(CloudStamps(put(folder / "s.csv", "\xef\xbb\xbf" + text)).of("a.xyz", {}) == 1'500'000);
  std::string wide;
  for (const char c : text) wide += {c, '\0'};
  for (const std::string mark : {"\xff\xfe", ""})
    check_error(error_of([&] { CloudStamps{put(folder / "w.csv", mark + wide)}; }), Status::unsupported_input,
                {"w.csv: the text is in UTF-16"});
}
