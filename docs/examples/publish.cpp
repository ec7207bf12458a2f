// publish.cpp - send clouds to a running lbea-serve, as a camera does.
//   c++ -std=c++20 publish.cpp $(pkg-config --cflags --libs lbea-wire) -o publish
//   ./publish ipc:///tmp/frames < cloud.xyz
#include <lbea/wire/codec.hpp>
#include <lbea/wire/streams.hpp>

#include <iostream>
#include <random>
#include <thread>

using namespace std::chrono_literals;

void grab(std::vector<lbea::Point>& points) {  // replace by your camera; reads lines of x y z
  for (lbea::Point p; std::cin >> p.x >> p.y >> p.z;) points.push_back(p);
}

int main(int argc, char** argv) try {
  lbea::wire::WireContext context;
  lbea::wire::FrameSink sink(context, argc > 1 ? argv[1] : "ipc:///tmp/frames");
  lbea::wire::Encoder encoder;
  const std::uint64_t session = std::random_device{}();  // a new random number at each start
  std::vector<lbea::Point> points;
  grab(points);
  if (!sink.wait_ready(5s)) throw std::runtime_error("no receiver at this endpoint; start lbea-serve");
  for (std::uint64_t id = 0; id < 10; ++id) {  // increases by one per capture, also if it is refused
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    sink.send(encoder.frame({.id = id, .stamp_ns = std::chrono::nanoseconds(now).count(), .points = points}, session));
    std::this_thread::sleep_for(10ms);
  }
  static_cast<void>(sink.flush(5s));
  std::cout << "sent " << sink.tally().sent << ", refused " << sink.tally().refused << '\n';
  return sink.tally().refused == 0 ? 0 : 1;
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
