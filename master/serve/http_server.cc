#include "master/serve/http_server.h"

#include <unistd.h>

#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <list>
#include <optional>
#include <sstream>
#include <utility>

namespace gapfarm {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
using tcp = asio::ip::tcp;

constexpr unsigned kQuietTicks = 15;  // after so many a stream says that it is still there

// The head that all answers have.
template <class Response>
void set_policies(Response& r) {
  r.set(http::field::cache_control, "no-cache");
  r.set("X-Content-Type-Options", "nosniff");
  r.set(http::field::x_frame_options, "DENY");
  r.set("Referrer-Policy", "no-referrer");
  r.set("Cross-Origin-Resource-Policy", "same-origin");
  r.set("Cross-Origin-Opener-Policy", "same-origin");
}

// Errors of connections are their own end: there is nobody to notify.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  using List = std::list<std::shared_ptr<Connection>>;

  Connection(tcp::socket socket, const HttpHandler& handler, const HttpLimits& limits, List& list,
             std::size_t& streams)
      : stream_(std::move(socket)),
        handler_(handler),
        limits_(limits),
        list_(list),
        streams_(streams),
        timer_(stream_.get_executor()) {}

  void start() {
    place_ = list_.insert(list_.end(), shared_from_this());
    read();
  }

  void close() {
    if (!place_) return;
    const auto place = *std::exchange(place_, std::nullopt);
    if (watched_) --streams_;
    watched_ = nullptr;
    timer_.cancel();
    beast::error_code ignored;
    stream_.socket().shutdown(tcp::socket::shutdown_both, ignored);
    stream_.close();
    list_.erase(place);  // last: it may end this
  }

 private:
  void read() {
    parser_.emplace();
    parser_->header_limit(limits_.header_bytes);
    parser_->body_limit(std::uint64_t{0});
    stream_.expires_after(limits_.time);
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](beast::error_code error, std::size_t) {
                       self->was_read(error);
                     });
  }

  void was_read(beast::error_code error) {
    if (!place_) return;
    if (!error) {
      list_.splice(list_.end(), list_, *place_);  // the latest to be heard of
      HttpResponse response = answer();
      if (response.watched) return watch(std::move(response));
      return write(std::move(response), parser_->get().keep_alive());
    }
    if (error == http::error::header_limit) return write(plain_response(431, "Too long."), false);
    if (error == http::error::body_limit) {
      return write(plain_response(413, "Requests have no body here."), false);
    }
    const bool garbage = error.category() == make_error_code(http::error::bad_method).category();
    if (garbage && error != http::error::end_of_stream && error != http::error::partial_message) {
      return write(plain_response(400, "That is no HTTP request."), false);
    }
    close();
  }

  HttpResponse answer() const {
    const auto& message = parser_->get();
    const auto text = [&](http::field field) {
      const auto value = message[field];
      return std::string(value.data(), value.size());
    };
    const auto method = message.method_string(), target = message.target();
    // A request with two hosts means to fool somebody.
    const bool one_host = message.count(http::field::host) == 1;
    return handler_(
        {std::string(method.data(), method.size()), std::string(target.data(), target.size()),
         one_host ? text(http::field::host) : std::string(), text(http::field::if_none_match)});
  }

  void write(HttpResponse from, bool keep) {
    const bool head = parser_->is_header_done() && parser_->get().method() == http::verb::head;
    response_.emplace(static_cast<http::status>(from.status), 11);
    auto& r = *response_;
    r.set(http::field::content_type, from.content_type);
    set_policies(r);
    if (!from.etag.empty()) r.set(http::field::etag, from.etag);
    if (!from.allow.empty()) r.set(http::field::allow, from.allow);
    r.keep_alive(keep);
    r.content_length(from.status == 304 ? 0 : from.body.size());
    if (!head && from.status != 304) r.body() = std::move(from.body);
    serializer_.emplace(r);
    stream_.expires_after(limits_.time);
    const auto written = [self = shared_from_this(), keep](beast::error_code error, std::size_t) {
      if (!self->place_) return;
      if (error || !keep) return self->close();
      self->read();
    };
    if (head) {
      http::async_write_header(stream_, *serializer_, written);
    } else {
      http::async_write(stream_, *serializer_, written);
    }
  }

  // --- a stream of events: it has no end, and its length is not known ---

  void watch(HttpResponse from) {
    if (parser_->get().method() == http::verb::head) return write(plain_response(200, ""), false);
    if (streams_ >= limits_.streams) {
      return write(plain_response(503,
                                  "Too many pages are open for each to hear what is new; this one "
                                  "has to ask by itself."),
                   false);
    }
    ++streams_;
    watched_ = std::move(from.watched);
    http::response<http::empty_body> r(http::status::ok, 11);
    r.set(http::field::content_type, "text/event-stream");
    set_policies(r);
    r.keep_alive(false);
    std::ostringstream head;
    head << r.base();
    stream_.expires_never();
    hear_end();
    send(head.str() + "retry: 4000\n\n");
    tick();
  }

  // Nothing is expected; what comes is the end, or somebody who does not know what this is.
  void hear_end() {
    stream_.socket().async_read_some(asio::buffer(unexpected_),
                                     [self = shared_from_this()](beast::error_code, std::size_t) {
                                       if (self->place_) self->close();
                                     });
  }

  void tick() {
    if (!place_) return;
    // Whoever did not take what was sent ticks ago is gone or does not read.
    if (sending_ && ++late_ * limits_.watch_interval > limits_.time) return close();
    if (!sending_) {
      late_ = 0;
      if (std::string now = watched_(); now != reported_) {
        reported_ = std::move(now);
        send("data: " + reported_ + "\n\n");
      } else if (++quiet_ >= kQuietTicks) {
        send(": still here\n\n");
      }
    }
    timer_.expires_after(limits_.watch_interval);
    timer_.async_wait([self = shared_from_this()](beast::error_code error) {
      if (!error) self->tick();
    });
  }

  void send(std::string text) {
    list_.splice(list_.end(), list_, *place_);
    outgoing_ += std::move(text);
    quiet_ = 0;
    if (sending_) return;
    sending_ = true;
    on_wire_ = std::exchange(outgoing_, {});
    asio::async_write(stream_.socket(), asio::buffer(on_wire_),
                      [self = shared_from_this()](beast::error_code error, std::size_t) {
                        if (!self->place_) return;
                        self->sending_ = false;
                        if (error) return self->close();
                        if (!self->outgoing_.empty()) self->send({});
                      });
  }

  beast::tcp_stream stream_;
  const HttpHandler& handler_;
  const HttpLimits& limits_;
  List& list_;
  std::size_t& streams_;  // of all connections
  asio::steady_timer timer_;
  std::function<std::string()> watched_;  // of a stream
  std::string reported_, outgoing_, on_wire_;
  bool sending_ = false;
  unsigned quiet_ = 0, late_ = 0;  // ticks
  std::array<char, 64> unexpected_;
  std::optional<List::iterator> place_;  // none: closed
  beast::flat_buffer buffer_{64 * 1024};
  std::optional<http::request_parser<http::empty_body>> parser_;
  std::optional<http::response<http::string_body>> response_;
  std::optional<http::response_serializer<http::string_body>> serializer_;
};

class BeastServer : public HttpServer {
 public:
  BeastServer(HttpHandler handler, const HttpLimits& limits)
      : handler_(std::move(handler)), limits_(limits) {}

  Status open(std::uint16_t port) {
    const tcp::endpoint here(asio::ip::address_v4::loopback(), port);
    beast::error_code error;
    acceptor_.open(here.protocol(), error);
    if (!error) acceptor_.set_option(asio::socket_base::reuse_address(true), error);
    if (!error) acceptor_.bind(here, error);
    if (!error) acceptor_.listen(asio::socket_base::max_listen_connections, error);
    if (error) {
      return Error{"cannot listen on 127.0.0.1:" + std::to_string(port) + ": " + error.message() +
                   "; choose another --port"};
    }
    return {};
  }

  std::uint16_t port() const override {
    beast::error_code ignored;
    return acceptor_.local_endpoint(ignored).port();
  }

  void run(int stop_fd) override {
    // A copy of the descriptor: the other end stays whose it was.
    asio::posix::stream_descriptor stop(context_, ::dup(stop_fd));
    stop.async_wait(asio::posix::stream_descriptor::wait_read,
                    [this](beast::error_code) { context_.stop(); });
    accept();
    context_.run();
    while (!connections_.empty()) connections_.front()->close();
    context_.restart();
    context_.poll();  // what was under way learns that it was closed
  }

 private:
  void accept() {
    acceptor_.async_accept([this](beast::error_code error, tcp::socket socket) {
      // Out of descriptors: what is quiet gives its own.
      if (error == asio::error::no_descriptors && !connections_.empty()) {
        connections_.front()->close();
      }
      if (!error) {
        while (connections_.size() >= limits_.connections) connections_.front()->close();
        std::make_shared<Connection>(std::move(socket), handler_, limits_, connections_, streams_)
            ->start();
      }
      if (acceptor_.is_open()) accept();
    });
  }

  HttpHandler handler_;
  HttpLimits limits_;
  asio::io_context context_{1};
  tcp::acceptor acceptor_{context_};
  Connection::List connections_;
  std::size_t streams_ = 0;
};

}  // namespace

Result<std::unique_ptr<HttpServer>> HttpServer::listen(std::uint16_t port, HttpHandler handler,
                                                       const HttpLimits& limits) {
  auto server = std::make_unique<BeastServer>(std::move(handler), limits);
  RETURN_IF_ERROR(server->open(port));
  return std::unique_ptr<HttpServer>(std::move(server));
}

}  // namespace gapfarm
