#include "tools/monitor/web/viewer_session.hpp"

#include <algorithm>
#include <utility>

namespace lbea::tool::web {
namespace {

using namespace std::chrono_literals;

constexpr auto handshake_timeout = 5s;
constexpr std::size_t largest_viewer_message = 16 * 1024;
constexpr unsigned most_complaints = 100;  // then it is no viewer
/// By channel. Stalled viewers hold the same messages: their memory does not grow with their number.
constexpr std::array<std::size_t, viewer_channels> most_waiting{2, 1024, 2};

std::size_t place(ViewerChannel channel) { return static_cast<std::size_t>(channel); }

}  // namespace

Viewer::Viewer(beast::tcp_stream stream, Shared& shared, Seat seat)
    : stream_(std::move(stream)),
      shared_(shared),
      connection_(std::move(seat)),
      viewing_(shared.viewing),
      buffer_(largest_viewer_message) {
  for (std::string& text : viewer_greeting(shared.session)) greeting_.push_back(std::move(text));
  shared_.viewers.insert(this);
}

Viewer::~Viewer() { shared_.viewers.erase(this); }

void Viewer::accept(const Request& request, std::string_view subprotocol) {
  stream_.set_option(websocket::stream_base::timeout{handshake_timeout, shared_.limits.silence, true});
  stream_.set_option(websocket::stream_base::decorator([subprotocol](websocket::response_type& response) {
    response.set(http::field::server, "lbea-monitor");
    response.set(http::field::sec_websocket_protocol, beast::string_view(subprotocol.data(), subprotocol.size()));
  }));
  stream_.auto_fragment(false);  // else a system call for every 4 kB
  stream_.read_message_max(largest_viewer_message);
  stream_.async_accept(request, [self = shared_from_this()](beast::error_code error) {
    if (error) return;
    self->open_ = true;
    self->read();
    self->write_next();
  });
}

void Viewer::read() {
  stream_.async_read(buffer_, [self = shared_from_this()](beast::error_code error, std::size_t) {
    if (error)
      self->open_ = false;
    else
      self->take();
  });
}

void Viewer::take() {
  const auto bytes = buffer_.cdata();
  complaint_ = subscriptions_.take({static_cast<const char*>(bytes.data()), bytes.size()});
  buffer_.consume(buffer_.size());
  if (!complaint_.empty() && ++complaints_ > most_complaints) {
    open_ = false;
    return beast::get_lowest_layer(stream_).close();
  }
  if (!writing_) write_next();
  read();
}

void Viewer::offer(const std::shared_ptr<const ViewerMessage>& message) {
  if (!open_ || !subscriptions_.number_of(message->channel)) return;
  if (waiting_of_[place(message->channel)] == most_waiting[place(message->channel)]) drop_oldest(message->channel);
  waiting_.push_back(message);
  ++waiting_of_[place(message->channel)];
  if (!writing_) write_next();
}

void Viewer::drop_oldest(ViewerChannel channel) {
  waiting_.erase(std::ranges::find_if(waiting_, [&](const auto& message) { return message->channel == channel; }));
  --waiting_of_[place(channel)];
  ++left_out_;
}

void Viewer::write_next() {
  if (!greeting_.empty()) {
    std::string text = std::move(greeting_.front());
    greeting_.pop_front();
    return write_text(std::move(text));
  }
  if (!complaint_.empty()) return write_text(viewer_notice(ViewerNotice::error, std::exchange(complaint_, {})));
  if (left_out_ > 0)
    return write_text(viewer_notice(
        ViewerNotice::warning,
        std::to_string(std::exchange(left_out_, 0)) + " messages were left out: this viewer reads too slowly."));
  while (!waiting_.empty()) {
    in_flight_ = std::move(waiting_.front());
    waiting_.pop_front();
    --waiting_of_[place(in_flight_->channel)];
    if (subscriptions_.number_of(in_flight_->channel)) return write_message();
  }
  in_flight_.reset();
}

void Viewer::write_text(std::string text) {
  writing_ = true;
  text_ = std::move(text);
  stream_.text(true);
  stream_.async_write(boost::asio::buffer(text_),
                      [self = shared_from_this()](beast::error_code error, std::size_t) { self->written(error); });
}

void Viewer::write_message() {
  writing_ = true;
  head_ = viewer_head(*subscriptions_.number_of(in_flight_->channel), in_flight_->time_ns);
  stream_.binary(true);
  const std::array<boost::asio::const_buffer, 2> parts{boost::asio::buffer(head_),
                                                       boost::asio::buffer(in_flight_->payload)};
  stream_.async_write(parts,
                      [self = shared_from_this()](beast::error_code error, std::size_t) { self->written(error); });
}

void Viewer::written(beast::error_code error) {
  writing_ = false;
  in_flight_.reset();
  if (!error && open_) write_next();
}

}  // namespace lbea::tool::web
