#include "tests/clouds/cloud_support.hpp"

#include <doctest/doctest.h>

using namespace lbea;
using namespace lbea::io;
using namespace lbea::test;

namespace {

const std::string xyz = "property float x\nproperty float y\nproperty float z\n";

Error refusal(const std::string& text) {
  return error_of([&] { (void)parse_ply(bytes_of(text), "t.ply"); });
}

std::string file(const std::string& format, const std::string& body, const std::string& rows = "") {
  return "ply\nformat " + format + " 1.0\n" + body + "end_header\n" + rows;
}

/// Refused as damaged, with the file's name and `where` in the sentence.
void check_refused(const std::string& text, const std::string& where) {
  check_error(refusal(text), Status::bad_input, {"t.ply", where});
}

}  // namespace

TEST_CASE("a binary file cut at any byte is refused") {
  const std::string whole = file("binary_little_endian", "element vertex 3\n" + xyz, std::string(36, '\1'));
  CHECK(refusal(whole).status == Status::ok);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    CAPTURE(size);
    CHECK(refusal(whole.substr(0, size)).status != Status::ok);
  }
}

TEST_CASE("an ASCII file cut before its last value is refused, with the line") {
  const std::string whole = file("ascii", "element vertex 2\n" + xyz, "1 2 3\n4 5 6\n");
  CHECK(refusal(whole).status == Status::ok);
  for (std::size_t size = 0; size < whole.size() - 2; ++size) {
    CAPTURE(size);
    CHECK(refusal(whole.substr(0, size)).status != Status::ok);
  }
  check_refused(whole.substr(0, whole.size() - 4), "line 9: too few values");
  check_refused(whole.substr(0, whole.size() - 6), "1 of 2 rows");
}

TEST_CASE("declared counts are held against the file before memory is asked for") {
  for (const std::string count : {"4", "4294967295", "4294967296", "1537228672809129302", "18446744073709551615"}) {
    check_refused(file("binary_little_endian", "element vertex " + count + "\n" + xyz, std::string(36, 'x')),
                  "declares " + count + " rows");
    check_refused(file("ascii", "element vertex " + count + "\n" + xyz, "1 2 3\n4 5 6\n7 8 9\n"), "3 of " + count);
    check_refused(
        file("binary_little_endian", "element face " + count + "\nproperty list uchar int i\nelement vertex 1\n" + xyz,
             std::string(3, '\0')),
        "declares " + count);
  }
  check_refused(file("ascii", "element vertex 18446744073709551616\n" + xyz), "line 3");
  check_refused(file("ascii", "element vertex -1\n" + xyz), "line 3");
  // rows of no bytes cost nothing, however many
  const std::string hollow = "element a 18446744073709551615\nelement vertex 1\n" + xyz;
  CHECK(parse_ply(bytes_of(file("binary_little_endian", hollow, std::string(12, 'x'))), "t").points.size() == 1);
  CHECK(parse_ply(bytes_of(file("ascii", hollow, "1 2 3")), "t").points.size() == 1);
}

TEST_CASE("lists that reach past the end or have a negative count") {
  const std::string body = "element face 1\nproperty list int double i\nelement vertex 1\n" + xyz;
  check_refused(file("binary_little_endian", body, std::string("\xff\xff\xff\x7f", 4) + std::string(40, 'x')),
                "cut short");
  check_refused(file("binary_little_endian", body, std::string("\xff\xff\xff\xff", 4) + std::string(40, 'x')),
                "negative");
  check_refused(file("ascii", "element vertex 1\nproperty list int int i\n" + xyz, "-1 1 2 3\n"), "negative");
  check_refused(file("ascii", "element vertex 1\nproperty list int int i\n" + xyz, "1e30 1 2 3\n"), "too few values");
}

TEST_CASE("headers without usable content are refused with the line") {
  check_refused("", "line 0");
  check_refused("plx\n", "line 1");
  check_refused("ply\nelement vertex 1\n" + xyz + "end_header\n", "no \"format\"");
  check_refused(file("ascii", "elemnt vertex 1\n"), "line 3: unknown keyword \"elemnt\"");
  check_refused(file("ascii", "element vertex 1\nproperty real x\n"), "line 4: unknown type \"real\"");
  check_refused(file("ascii", "element vertex 1\nproperty list float int x\n"), "not an integer");
  check_refused(file("ascii", "property float x\n"), "before the first element");
  check_refused(file("ascii", "element vertex 1\nproperty float\n"), "without a name");
  check_refused(file("ascii", "element vertex\n"), "line 3");
  check_refused(file("ascii", "element face 0\n"), "no element \"vertex\"");
  check_refused(file("ascii", "element vertex 1\nproperty float x\nproperty float y\n", "1 2\n"), "x, y and z");
  check_refused(file("ascii", "element vertex 1\nproperty float x\n" + xyz, "1 1 2 3\n"), "each once");
  check_refused(file("ascii", "element vertex 1\n" + xyz, "1 2 three\n"), "line 8: \"three\" is not a number");
  CHECK(refusal("ply\nformat ascii 2.0\n").status == Status::unsupported_input);
  CHECK(refusal("ply\nformat binary_middle_endian 1.0\n").status == Status::unsupported_input);
}
