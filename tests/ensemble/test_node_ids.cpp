#include "adapters/ensemble/ensemble_toml.hpp"
#include "tests/support/files.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"

#include <doctest/doctest.h>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::io;
using namespace lbea::test;
using Ids = std::vector<std::uint32_t>;

namespace {

Ids read_ids(const std::string& text) {
  const TemporaryFolder folder;
  return read_node_ids(put(folder / "n.txt", text));
}

Error refusal(const std::string& text) {
  return error_of([&] { (void)read_ids(text); });
}

}  // namespace

TEST_CASE("ids in the order of the file, however they are separated") {
  CHECK(read_ids("7") == Ids{7});
  CHECK(read_ids("11\n12\r\n\n13\n") == Ids{11, 12, 13});
  CHECK(read_ids("# the front\n11, 12;13\t14 15 # and so on\n") == Ids{11, 12, 13, 14, 15});
  CHECK(read_ids("4294967295 0") == Ids{4'294'967'295, 0});
}

TEST_CASE("a byte order mark is skipped, UTF-16 named: its ids were cut at the first zero byte") {
  CHECK(read_ids("\xef\xbb\xbf\x31\n2\n") == Ids{1, 2});
  using namespace std::string_literals;
  for (const std::string& text : {"\xff\xfe\x31\0\n\0"s, "1\0\n\0"s, "\0\x31\0\n"s})
    CHECK(mentions(refusal(text), "n.txt: the text is in UTF-16; save it in UTF-8"));
}

TEST_CASE("what is no id is refused with its line") {
  for (const std::string text : {"1\n2x\n", "1\n-2\n", "1\n2.0\n", "1\n4294967296\n", "1\n+2\n"}) {
    CAPTURE(text);
    CHECK(refusal(text).status == Status::bad_input);
    CHECK(mentions(refusal(text), "n.txt, line 2"));
  }
  CHECK(mentions(refusal(""), "no node ids"));
  CHECK(mentions(refusal("# none\n"), "no node ids"));
  CHECK(error_of([] { (void)read_node_ids("/nowhere/n.txt"); }).status == Status::file_not_found);
}
