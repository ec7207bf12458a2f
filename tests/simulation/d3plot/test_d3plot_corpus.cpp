// The fuzzer's corpus is what the test writer writes. To write it anew: test_d3plot --no-skip -tc="write the corpus".
#include <doctest/doctest.h>

#include <fstream>
#include <iterator>

#include "adapters/simulation/open.hpp"
#include "tests/support/d3plot_writer.hpp"
#include "tests/support/test_data.hpp"

namespace {

std::filesystem::path corpus_folder() { return lbea::test::data() / "fuzz" / "d3plot"; }

}  // namespace

TEST_CASE("every file of the corpus is a database as the writer writes it, and opens") {
  for (const auto& entry : lbea::test::d3plot_corpus()) {
    const auto& name = entry.first;
    const auto& database = entry.second;
    CAPTURE(name);
    std::ifstream in(corpus_folder() / name, std::ios::binary);
    const std::vector<char> stored{std::istreambuf_iterator<char>(in), {}};
    const auto files = d3plot_files(database);
    REQUIRE(files.size() == 1);
    const auto* written = reinterpret_cast<const char*>(files.front().data());
    CHECK((stored == std::vector<char>(written, written + files.front().size())));
    CHECK(lbea::io::open_simulation(corpus_folder() / name)->states() == database.states.size());
  }
}

TEST_CASE("write the corpus" * doctest::skip()) {
  for (const auto& [name, database] : lbea::test::d3plot_corpus())
    CHECK(std::filesystem::exists(write_d3plot(database, corpus_folder(), name)));
}
