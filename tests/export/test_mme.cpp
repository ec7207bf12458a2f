// ISO-MME: files, names, codes and values by a small reader; nothing is left of a folder that was not completed.
#include "adapters/export/mme.hpp"

#include "adapters/files/atomic_folder.hpp"
#include "tests/export/sample_mme.hpp"
#include "tests/support/files.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"

#include <doctest/doctest.h>

#include <map>
#include <sstream>

using namespace lbea;
using namespace lbea::io;
using namespace lbea::test;

namespace {

struct ReadFile {
  std::map<std::string, std::string> header;
  std::vector<std::string> values;
  explicit ReadFile(const std::filesystem::path& file) {
    REQUIRE(std::filesystem::exists(file));
    std::istringstream lines(text_of(file));
    for (std::string line; std::getline(lines, line);) {
      const std::size_t colon = line.find(':');
      if (colon == line.npos) {
        values.push_back(line);
        continue;
      }
      CHECK(values.empty());  // the header comes first
      CHECK(colon >= 28);
      header[line.substr(0, line.find_last_not_of(' ', colon - 1) + 1)] = line.substr(colon + 1);
    }
  }
};

std::string rounded(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", value);
  return text;
}

}  // namespace

TEST_CASE("a folder in the layout of ISO 13499 with all channels, values to nine digits") {
  const TemporaryFolder folder;
  const MmeTest test = sample_mme();
  write_mme(folder / "Test 7", test);
  const ReadFile mme(folder / "Test 7/Test 7.mme"), list(folder / "Test 7/Channel/Test 7.chn");
  CHECK(mme.header.at("Data format edition number") == "1.6");
  CHECK(mme.header.at("Type of the test") == "impact");
  CHECK(mme.header.at("Comments") == "two lines");
  CHECK(list.header.at("Number of channels") == "9");
  CHECK(files_in(folder / "Test 7/Channel") == 10);
  for (std::size_t i = 0; i < test.channels.size(); ++i) {
    const MmeChannel& channel = test.channels[i];
    const std::string number = "00" + std::to_string(i + 1);
    const ReadFile file(folder / "Test 7/Channel" / ("Test 7." + number));
    CAPTURE(i);
    CHECK(file.header.at("Channel code").size() == 16);
    CHECK(list.header.at("Name of channel " + number) ==
          file.header.at("Channel code") + " / " + file.header.at("Name of the channel"));
    CHECK(file.header.at("Unit") == channel.unit);
    CHECK(file.header.at("Reference channel") == "implicit");
    CHECK(std::stod(file.header.at("Time of first sample")) == channel.first_s);
    CHECK(std::stod(file.header.at("Sampling interval")) == channel.interval_s);
    CHECK(file.header.at("Number of samples") == std::to_string(channel.values.size()));
    REQUIRE(file.values.size() == channel.values.size());
    for (std::size_t k = 0; k < channel.values.size(); ++k) {
      if (std::isfinite(channel.values[k]))
        CHECK(std::stod(file.values[k]) == std::stod(rounded(channel.values[k])));
      else
        CHECK(file.values[k] == "NOVALUE");
    }
  }
}

TEST_CASE("codes, names and extremes") {
  const TemporaryFolder folder;
  write_mme(folder / "t", sample_mme());
  const auto header = [&](int i) { return ReadFile(folder / "t/Channel" / ("t.00" + std::to_string(i))).header; };
  CHECK(header(1).at("Channel code") == "000000000100DSX0");
  CHECK(header(1).at("Name of the channel") == "struck end");
  CHECK(header(1).at("First global maximum value") == rounded(1e9 / 7));
  CHECK(header(1).at("First global minimum value") == "-97.21035");
  CHECK(std::stod(header(1).at("Time of minimum value")) == doctest::Approx(-0.0015 + 3 * 0.00075));
  CHECK(header(2).at("Channel code") == "000000000200VERD");
  CHECK(header(2).at("Name of the channel") == "Träger, \"oben\" 'links'");
  CHECK(header(2).at("Channel frequency class") == "60");
  CHECK(header(2).at("First global maximum value") == "2.5");  // infinity is no value
  CHECK(header(3).at("Name of the channel") == "of two  lines and  controls");
  CHECK(header(4).at("First global maximum value") == "NOVALUE");
  CHECK(header(4).at("Time of minimum value") == "NOVALUE");
  CHECK(header(6).at("Name of the channel") == "NOVALUE");
  CHECK(header(6).at("Channel code") == "000000000600DSYS");
  CHECK(MmeCode{1024, "AC", 'Z', 'A'}.text() == "000000102400ACZA");
}

TEST_CASE("a folder, file or link of the name is refused and stays; as are names that no folder can have") {
  const TemporaryFolder folder;
  put(folder / "file", "earlier");
  std::filesystem::create_directory(folder / "empty");
  std::filesystem::create_symlink(folder / "nowhere", folder / "link");
  for (const char* name : {"file", "empty", "link", "empty/"})
    check_error(error_of([&] { write_mme(folder / name, sample_mme()); }), Status::write_failed,
                {"exists; give another name"});
  CHECK(text_of(folder / "file") == "earlier");
  for (const char* name : {"empty/.", "..", "/"})
    check_error(error_of([&] { write_mme(folder / name, sample_mme()); }), Status::write_failed, {"is no name"});
  check_error(error_of([&] { write_mme(folder / "absent/t", sample_mme()); }), Status::write_failed,
              {"No such file or directory"});
  CHECK(files_in(folder.path()) == 3);
  write_mme(folder / "new/", sample_mme());
  CHECK(std::filesystem::exists(folder / "new/new.mme"));
}

TEST_CASE("a stop before any channel, and a full disk, leave no folder and no temporary files") {
  const TemporaryFolder folder;
  const std::size_t checks = sample_mme().channels.size() + 1;
  for (std::size_t stop = 0; stop < checks; ++stop) {
    std::size_t calls = 0;
    const auto check = [&] {
      if (calls++ == stop) throw Error(Status::write_failed, "stopped");
    };
    check_error(error_of([&] { write_mme(folder / "t", sample_mme(), check); }), Status::write_failed, {"stopped"});
    CHECK(std::filesystem::is_empty(folder.path()));
  }
  {
    const FullDisk full(1000);
    CHECK(error_of([&] { write_mme(folder / "t", sample_mme()); }).status == Status::write_failed);
  }
  CHECK(std::filesystem::is_empty(folder.path()));
}

TEST_CASE("the finished folder has the permissions of a new one") {
  const TemporaryFolder folder;
  write_mme(folder / "t", sample_mme());
  std::filesystem::create_directory(folder / "other");
  CHECK(std::filesystem::status(folder / "t").permissions() == std::filesystem::status(folder / "other").permissions());
}
