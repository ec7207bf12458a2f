// publish.cpp - send clouds to a running lbea-serve, as a camera does.
//   c++ -std=c++20 publish.cpp $(pkg-config --cflags --libs lbea-wire) -o publish
//   ./publish ipc:///tmp/frames < cloud.xyz
#include <lbea/wire/client.hpp>

#include <iostream>
#include <thread>

using namespace std::chrono;

void grab(std::vector<lbea::Point>& points) {  // replace by your camera; reads lines of x y z
  for (lbea::Point p; std::cin >> p.x >> p.y >> p.z;) points.push_back(p);
}

int main(int argc, char** argv) try {
  lbea::wire::WireContext context;
  lbea::wire::FrameSender sender(context, argc > 1 ? argv[1] : "ipc:///tmp/frames");  // waits 5 s for lbea-serve
  std::vector<lbea::Point> points;
  grab(points);
  for (int i = 0; i < 10; ++i) {
    sender.send(points, duration_cast<nanoseconds>(system_clock::now().time_since_epoch()).count());  // does not wait
    std::this_thread::sleep_for(10ms);
  }
  sender.end_stream();
  const lbea::wire::SendTally tally = sender.finish();
  std::cout << "sent " << tally.sent << ", refused " << tally.refused << '\n';
  return tally.refused == 0 ? 0 : 1;
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
