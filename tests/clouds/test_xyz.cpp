#include "tests/clouds/cloud_support.hpp"
#include "tests/support/files.hpp"
#include "tests/support/test_data.hpp"

#include <doctest/doctest.h>

#include <array>
#include <cstdio>
#include <limits>
#include <random>

using namespace lbea;
using namespace lbea::io;
using namespace lbea::test;

namespace {

constexpr float quiet_nan = std::numeric_limits<float>::quiet_NaN();
const std::vector<Point> two{{1.5f, -2, 3e-3f}, {4, 5.25f, -6}};

std::vector<Point> points_of(const std::string& text) { return parse_xyz(bytes_of(text), "t.xyz").points; }

void check_refused(const std::string& text, const std::string& where) {
  check_error(error_of([&] { (void)parse_xyz(bytes_of(text), "t.xyz"); }), Status::bad_input, {"t.xyz", where});
}

}  // namespace

TEST_CASE("separators: blanks, tabs, commas, semicolons, with and without blanks around") {
  for (const std::string s : {" ", "   ", "\t", ",", ";", ", ", " ; ", "\t ", ",\t"}) {
    CAPTURE(s);
    const std::string text = "1.5" + s + "-2" + s + "3e-3\n+4" + s + "5.25" + s + "-6";
    CHECK(same(points_of(text), two));
    CHECK(same(points_of(text + "\n"), two));
    CHECK(same(points_of("\r\n" + text + "\r\n\r\n"), two));
  }
}

TEST_CASE("the comma as decimal sign, where another separator is there") {
  CHECK(same(points_of("x;y;z\n1,5;-2;3e-3\n4;5,25;-6\n"), two));
  CHECK(same(points_of("1,5\t-2\t3e-3\n4\t5,25\t-6\n"), two));
  check_refused("1,5 2,5 3,5\n", "line 1");         // might be anything
  check_refused("1;2;3\n1.234,5;0;0\n", "line 2");  // thousands
  check_refused("1;2;3\n0," + std::string(70, '0') + ";0;0\n", "line 2: \"0,000");
}

TEST_CASE("tabs beside commas that separate") {
  for (const char* text : {",1,\t2,\t3\n", "P1\t,1,2,3\n", "1,2,3,\tgood\n"}) {
    CAPTURE(text);
    CHECK(same(points_of(text), {{1, 2, 3}}));
  }
  check_refused("1\t2\t3,\n", "line 1: fewer than 3 columns");
}

TEST_CASE("pixels and positions in one table are told apart by --columns: x, y were taken from pixels, Z from mm") {
  const std::string table = "x,y,u,v,X [mm],Y [mm],Z [mm],U,V,W\n100,200,1,2,10,20,30,0.5,0.25,-1\n";
  check_refused(table, "line 2: columns \"x\" and \"X\" could both be x; choose with --columns");
  const auto chosen = [&](const std::string& columns) {
    return parse_text_cloud(bytes_of(table), "t.csv", columns).points;
  };
  CHECK(same(chosen("X,Y,Z"), {{10, 20, 30}}));
  CHECK(same(chosen("X+U,Y+V,Z+W"), {{10.5f, 20.25f, 29}}));
  CHECK(same(points_of("x;y;z;x_error\n1;2;3;4\n"), {{1, 2, 3}}));
  CHECK(same(parse_text_cloud(bytes_of("# COORDINATE_X COORDINATE_Y COORDINATE_Z\n1 2 3\n"), "t",
                              "COORDINATE_X,COORDINATE_Y,COORDINATE_Z")
                 .points,
             {{1, 2, 3}}));
  for (const char* columns : {"X,Y", "X,Y,Q", "X+U+W,Y,Z", ",,"}) {
    CAPTURE(columns);
    CHECK(error_of([&] { (void)chosen(columns); }).status == Status::bad_input);
  }
}

TEST_CASE("decimal commas between commas were taken for columns: 1.5, 2.5, 3 as 1, 5, 2") {
  check_refused("X,Y,Z\n1,5,2,5,3,0\n", "line 2: the header names 3 columns, but the line has 6; with decimal commas");
  CHECK(same(points_of("X,Y,Z\n1,2,3,,\n"), {{1, 2, 3}}));
  CHECK(same(points_of("X;Y;Z\n1,5;2,5;3\n"), {{1.5f, 2.5f, 3}}));
}

TEST_CASE("columns by name, whatever their case, place and unit") {
  const std::vector<Point> one{{1, 2, 3}};
  CHECK(same(points_of("x,y,z\n1,2,3\n"), one));
  CHECK(same(points_of("X Y Z\n1 2 3\n"), one));
  CHECK(same(points_of("id;Z [mm];X [mm];quality;y (mm)\n77;3;1;0.5;2\n"), one));
  CHECK(same(points_of("id\tx coordinate\tz_mm\ty\n77\t1\t3\t2\n"), one));
  CHECK(same(points_of("x [mm] y [mm] z [mm]\n1 2 3\n"), one));
  CHECK(same(points_of("\"x\",\"y\",\"z\"\n\"1\",\"2\",\"3\"\n"), one));
  CHECK(same(points_of("\xef\xbb\xbfz,y,x\n3,2,1\n"), one));
  CHECK(same(points_of("xerr,yerr,zerr,x,y,z\n9,9,9,1,2,3\n"), one));
  CHECK(same(points_of("# z y x\n3 2 1\n"), one));
  CHECK(same(points_of("//X Y Z Intensity\n1 2 3 9\n"), one));
  CHECK(same(points_of("# x, y and z of the rig\n1 2 3\n"), one));  // a remark, not names: the widths differ
}

TEST_CASE("without names: the first three columns with numbers") {
  CHECK(same(points_of("P1,1,2,3,4\nP2,4,5,6,7\n"), {{1, 2, 3}, {4, 5, 6}}));
  CHECK(same(points_of("ok 1 valid 2 3\n"), {{1, 2, 3}}));
  CHECK(same(points_of("nan 2 3\n1 2 3\n"), {{quiet_nan, 2, 3}, {1, 2, 3}}));
}

TEST_CASE("three names in another order were ignored") {
  CHECK(same(points_of("pos_z,pos_y,pos_x\n3,2,1\n"), {{1, 2, 3}}));
  CHECK(same(points_of("# Coord.Z Coord.X Coord.Y\n3 1 2\n"), {{1, 2, 3}}));
  check_refused("depth,width,height\n1,2,3\n",
                "line 2: the header names columns, but not x, y and z; choose them with");
}

TEST_CASE("a title above the names of the columns") {
  CHECK(same(points_of("Test 12.5.2024\nz;y;x\n3;2;1\n"), {{1, 2, 3}}));
}

TEST_CASE("UTF-16 is named") {
  std::string wide = "\xff\xfe";
  for (const char c : std::string("X;Y;Z\n1;2;3\n")) wide += {c, '\0'};
  const TemporaryFolder folder;
  check_error(error_of([&] { (void)read_point_cloud(put(folder / "w.csv", wide)); }), Status::unsupported_input,
              {"w.csv: the text is in UTF-16; save it in UTF-8"});
}

// A folder of sensed frames holds a table of their truth as well. Its first three columns with numbers were once
// taken for points, and the test got a frame that nobody had captured.
TEST_CASE("a table about something else is not a cloud") {
  check_refused("frame,file,stamp_ns,run,state,time_s\n0,f.ply,0,run_1,0,0\n",
                "line 2: the header names columns, but not x, y and z");
}

TEST_CASE("comments, the stamp, missing values") {
  const PointCloud cloud = parse_xyz(bytes_of("# rig A\n% stamp_ns=1000050\n1,2,3\n// pause\nnan,NaN,-nan\n,,\n1,,3,x\n"
                                              "1.#QNAN,-1.#IND,4\n"),
                                     "t.csv");
  const Point missing{quiet_nan, quiet_nan, quiet_nan};
  CHECK(same(cloud.points, {{1, 2, 3}, missing, missing, {1, quiet_nan, 3}, {quiet_nan, quiet_nan, 4}}));
  CHECK(cloud.stamp_ns == 1000050);
  CHECK(cloud.source == "t.csv");
}

TEST_CASE("lines that end with a carriage return alone gave one point, Fortran's exponents none") {
  CHECK(same(points_of("x y z\r1 2 3\r4 5 6\r"), {{1, 2, 3}, {4, 5, 6}}));
  CHECK(same(points_of("1d3 -2.5D-1 3\n"), {{1000, -0.25f, 3}}));
  check_refused("1 2 3\n1d 2 3\n", "line 2: \"1d\" is not a number");
}

TEST_CASE("no points") {
  CHECK(points_of("x,y,z\n").empty());
  CHECK(points_of("# nothing seen\n").empty());
  CHECK(points_of("\n").empty());
  check_refused("", "empty");
}

TEST_CASE("lines that are no points are refused with their number") {
  check_refused("1 2 3\n4 5\n", "line 2: 2 columns where 3 are needed");
  check_refused("# c\n\n1,2,3\n4,5\n", "line 4");
  check_refused("1 2\n", "line 1: fewer than 3 columns");
  check_refused("x,y,z\n1,2,3\nx,y,z\n", "line 3: \"x\" is not a number");
  check_refused("x,y,z\ny,z,x\n", "line 2");
  check_refused("1 2 3\n1 2 3mm\n", "line 2: \"3mm\"");
  check_refused("1 2 3\n1 2 1e999\n", "line 2");
  check_refused("1 2 3\n1 2 ++3\n", "line 2");
  check_refused("1 2 3\n1 2 0x10\n", "line 2");
}

TEST_CASE("what is printed with nine digits is read bit for bit") {
  std::mt19937 random(4);
  std::uniform_real_distribution<float> value(-1000, 1000);
  std::vector<Point> points(5000);
  std::string text;
  std::array<char, 64> line{};
  for (Point& p : points) {
    p = {value(random), value(random) * 1e-30f, value(random) * 1e30f};
    std::snprintf(line.data(), line.size(), "%.9g;%.9g;%.9g\n", double{p.x}, double{p.y}, double{p.z});
    text += line.data();
  }
  CHECK(same(points_of(text), points));
}

TEST_CASE("the kind of a file is told from its content") {
  const TemporaryFolder folder;
  const auto put = [&](const std::string& name, const std::string& text) { return test::put(folder / name, text); };
  CHECK(same(read_point_cloud(put("a.ply", "1 2 3\n")).points, {{1, 2, 3}}));
  const auto ply = put("b.csv",
                       "ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\nproperty int y\nproperty int z\n"
                       "end_header\n1 2 3\n");
  CHECK(same(read_point_cloud(ply).points, {{1, 2, 3}}));
  for (const std::string end : {"\r\n", " \n"}) {  // after its first word
    std::string text = text_of(ply);
    CHECK(same(read_point_cloud(put("b.txt", text.replace(3, 1, end))).points, {{1, 2, 3}}));
  }
  CHECK(same(read_point_cloud(put("f.csv", "plywood,1,2,3\n")).points, {{1, 2, 3}}));
  check_error(error_of([&] { (void)read_point_cloud(put("g.txt", "ply")); }), Status::bad_input,
              {"g.txt", "no \"end_header\"", "cut short"});
  CHECK(error_of([&] { (void)read_point_cloud(put("c.pcd", "# .PCD v0.7\n")); }).status == Status::bad_input);
  CHECK(error_of([&] { (void)read_point_cloud(put("d.bin", std::string("\1\0\2", 3))); }).status ==
        Status::unsupported_input);
  CHECK(error_of([&] { (void)read_point_cloud(put("e.xyz", "")); }).status == Status::bad_input);
  CHECK(error_of([&] { (void)read_point_cloud(folder / "absent"); }).status == Status::file_not_found);
}
