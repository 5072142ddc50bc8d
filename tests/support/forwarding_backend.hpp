#pragma once

#include <functional>
#include <memory>
#include <utility>

#include "berth/backend.hpp"

namespace berth::test {

/// A stream that does what another does: for those that differ in one thing.
class ForwardingStream : public Stream {
 public:
  explicit ForwardingStream(std::unique_ptr<Stream> behind) : behind_(std::move(behind)) {}
  void upload(Buffer& buffer, const void* data, std::size_t bytes) override { behind_->upload(buffer, data, bytes); }
  void download(Buffer& buffer, void* data, std::size_t bytes) override { behind_->download(buffer, data, bytes); }
  void replay(Plan& plan) override { behind_->replay(plan); }
  std::unique_ptr<Event> record_event() override { return behind_->record_event(); }
  void flush() override { behind_->flush(); }
  bool is_immediate() const override { return behind_->is_immediate(); }
  bool finish() override { return behind_->finish(); }

 protected:
  Stream& behind() { return *behind_; }

 private:
  std::unique_ptr<Stream> behind_;
};

/// The same of a backend, whose streams are what `wrap` makes of the other's. Both outlive it.
class ForwardingBackend : public Backend {
 public:
  using Wrap = std::function<std::unique_ptr<Stream>(std::unique_ptr<Stream> behind)>;

  ForwardingBackend(const char* name, Backend& behind, Wrap wrap)
      : name_(name), behind_(behind), wrap_(std::move(wrap)) {}
  const char* name() const override { return name_; }
  DeviceInfo device() const override { return behind_.device(); }
  std::unique_ptr<Buffer> make_buffer(std::size_t bytes) override { return behind_.make_buffer(bytes); }
  std::unique_ptr<Stream> make_stream() override { return wrap_(behind_.make_stream()); }
  std::unique_ptr<Plan> record(const std::vector<Step>& steps) override { return behind_.record(steps); }

 protected:
  Backend& behind() { return behind_; }

 private:
  const char* name_;
  Backend& behind_;
  Wrap wrap_;
};

}  // namespace berth::test
