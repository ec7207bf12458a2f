// The client's end of the sockets: FrameSender and ResultReceiver.
#include "adapters/wire/codec/codec.hpp"
#include "adapters/wire/sockets/client.hpp"
#include "tests/support/test_data.hpp"
#include "tests/wire/wire_support.hpp"

#include <doctest/doctest.h>

using namespace lbea;
using namespace lbea::wire;
using namespace std::chrono_literals;

namespace {

Control next_control(FrameSource& source) {
  const auto message = source.receive(30s);
  REQUIRE(message);
  Control control;
  REQUIRE(decode_control(*message, control) == WireStatus::ok);
  return control;
}

/// Skips the heartbeats of a slow test.
DecodedFrame next_frame(FrameSource& source) {
  while (true) {
    const auto message = source.receive(30s);
    REQUIRE(message);
    DecodedFrame frame;
    if (message_kind(*message) == MessageKind::control) continue;
    REQUIRE(decode_frame(*message, frame) == WireStatus::ok);
    return frame;
  }
}

}  // namespace

TEST_CASE("a sender says hello, stays known in pauses, tells what it withheld before the next frame, says goodbye") {
  const test::TemporaryFolder folder;
  WireContext context;
  FrameSource source(context, "ipc://" + (folder / "frames").string());
  FrameSender sender(context, source.endpoint());
  const std::uint64_t session = sender.session();
  CHECK(next_control(source) == Control{session, ControlKind::hello, 0, 0});
  CHECK(next_control(source) == Control{session, ControlKind::heartbeat, 0, 0});
  const std::vector<Point> points(3, Point{1, 2, 3});
  REQUIRE(sender.send(points, 5, 30s));
  CHECK_FALSE(sender.send(points, -1));  // before 1970
  CHECK_FALSE(sender.send(nullptr));
  CHECK(next_frame(source).points.size() == 3);
  Control report;
  for (std::uint64_t withheld = 0; withheld < 2; withheld += report.withheld) report = next_control(source);
  CHECK(report == Control{session, ControlKind::heartbeat, 3, 1});
  REQUIRE(sender.send(points, 6, 30s));
  const DecodedFrame frame = next_frame(source);
  CHECK(frame.header.session == session);
  CHECK(frame.header.id == 3);
  CHECK(frame.header.stamp_ns == 6);
  CHECK(sender.next_id() == 4);
  const SendTally tally = sender.finish();
  CHECK(tally.captured == 4);
  CHECK(tally.sent == 2);
  CHECK(tally.refused == 2);
  CHECK(tally.handed_over == 2);
  do report = next_control(source);
  while (report.kind == ControlKind::heartbeat);
  CHECK(report == Control{session, ControlKind::goodbye, 4, 0});
}

TEST_CASE("a sender that ends the stream says no goodbye; one that goes out of scope does") {
  const test::TemporaryFolder folder;
  WireContext context;
  FrameSource source(context, "ipc://" + (folder / "frames").string());
  std::uint64_t ended = 0, left = 0;
  {
    FrameSender sender(context, source.endpoint()), moved(std::move(sender));
    moved.end_stream();
    std::this_thread::sleep_for(600ms);  // regression: heartbeats made the session active again
    ended = moved.session();
    left = FrameSender(context, source.endpoint()).session();
  }
  CHECK(ended != left);
  int ends = 0, goodbyes = 0, heartbeats = 0;
  while (const auto message = source.receive(ends == 1 && goodbyes == 1 ? 50ms : 30s)) {
    Control control;
    DecodedFrame frame;
    if (decode_control(*message, control) != WireStatus::ok) {
      CHECK(decode_frame(*message, frame) == WireStatus::end_of_stream);
      CHECK(frame.header.session == ended);
      ++ends;
    } else if (control.kind == ControlKind::goodbye) {
      CHECK(control.session == left);
      ++goodbyes;
    } else if (control.kind == ControlKind::heartbeat && ends > 0) {
      heartbeats += control.session == ended ? 1 : 0;
    }
  }
  CHECK(ends == 1);
  CHECK(goodbyes == 1);
  CHECK(heartbeats == 0);
}

TEST_CASE("a sender without a receiver is told where it wanted to send") {
  const test::TemporaryFolder folder;
  WireContext context;
  const std::string endpoint = "ipc://" + (folder / "nobody").string();
  const Error error = test::error_of([&] { FrameSender sender(context, endpoint, {}, 20ms); });
  CHECK(error.status == Status::endpoint_unavailable);
  CHECK(test::mentions(error, endpoint));
}

TEST_CASE("a receiver decodes results, keeps the latest state, counts what it lost and could not read") {
  const test::TemporaryFolder folder;
  WireContext context;
  ResultSink sink(context, "ipc://" + (folder / "results").string());
  ResultReceiver receiver(context, sink.endpoint());
  CHECK(receiver.receive(1ms) == nullptr);
  CHECK(receiver.state() == nullptr);
  Encoder encoder;
  REQUIRE(test::eventually([&] { return sink.has_newcomer(); }));
  WireState state;
  state.sequence = 10;
  state.method = "fit";
  sink.send(encoder.state(state));
  WireResult result;
  for (const std::uint64_t sequence : {11u, 14u, 0u}) {  // two are lost, then the matcher restarts
    result.sequence = result.frame_id = sequence;
    sink.send(encoder.result(result));
    if (sequence == 11) sink.send(std::vector<std::byte>(100));
  }
  for (const std::uint64_t id : {11u, 14u, 0u}) {
    const WireResult* received = receiver.receive(30s);
    REQUIRE(received != nullptr);
    CHECK(received->frame_id == id);
  }
  REQUIRE(receiver.state() != nullptr);
  CHECK(receiver.state()->method == "fit");
  CHECK(receiver.lost() == 2);
  CHECK(receiver.damaged() == 1);
  CHECK(receiver.receive(0ms) == nullptr);
}
