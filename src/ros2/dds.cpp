// Cyclone DDS takes messages as bytes from whoever brings a type of his own, as rmw_cyclonedds does: no code is
// generated from IDL, each message is laid out in one place (messages.cpp), and readers are found by the type's name
// alone. (With a type description on both sides names of members would have to agree too, and where they do not,
// nothing matches and nothing says so.) The interface is that of 0.10, which ROS 2 Humble to Jazzy and Debian 12 have.

#include "ros2/dds.hpp"

#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_sertype.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <vector>

#include "berth/error.hpp"
#include "ros2/messages.hpp"

namespace berth::ros2 {
namespace {

// A message's bytes; the base is what Cyclone knows of it.
struct Sample : ddsi_serdata {
  /// Padded to a multiple of four, since Cyclone reads so many.
  std::vector<u8> bytes;
  std::size_t size = 0;
};

Sample* new_sample(const ddsi_sertype* type, ddsi_serdata_kind kind, const u8* bytes, std::size_t size) {
  auto* sample = new Sample;
  ddsi_serdata_init(sample, type, kind);
  sample->hash = type->serdata_basehash;
  sample->bytes.reserve((size + 3) / 4 * 4);
  sample->bytes.assign(bytes, bytes + size);
  sample->bytes.resize((size + 3) / 4 * 4);
  sample->size = size;
  return sample;
}

const Sample& sample_of(const ddsi_serdata* data) { return *static_cast<const Sample*>(data); }

// Topics have no keys: every message belongs to the one instance, which Cyclone asks for as an empty sample.
ddsi_serdata* to_untyped(const ddsi_serdata* data) {
  Sample* key = new_sample(data->type, SDK_KEY, nullptr, 0);
  key->type = nullptr;
  return key;
}

ddsi_serdata* to_ser_ref(const ddsi_serdata* data, std::size_t offset, std::size_t size, ddsrt_iovec_t* part) {
  part->iov_base = const_cast<u8*>(sample_of(data).bytes.data()) + offset;
  part->iov_len = static_cast<ddsrt_iov_len_t>(size);
  return ddsi_serdata_ref(data);
}

ddsi_serdata_ops sample_operations() {
  ddsi_serdata_ops ops = {};
  ops.eqkey = [](const ddsi_serdata*, const ddsi_serdata*) { return true; };
  ops.get_size = [](const ddsi_serdata* data) { return static_cast<std::uint32_t>(sample_of(data).size); };
  ops.to_ser = [](const ddsi_serdata* data, std::size_t offset, std::size_t size, void* to) {
    std::memcpy(to, sample_of(data).bytes.data() + offset, size);
  };
  ops.to_ser_ref = to_ser_ref;
  ops.to_ser_unref = [](ddsi_serdata* data, const ddsrt_iovec_t*) { ddsi_serdata_unref(data); };
  ops.to_untyped = to_untyped;
  ops.free = [](ddsi_serdata* data) { delete static_cast<Sample*>(data); };
  ops.print = [](const ddsi_sertype*, const ddsi_serdata*, char* text, std::size_t size) {
    return static_cast<std::size_t>(std::snprintf(text, size, "berth"));
  };
  ops.get_keyhash = [](const ddsi_serdata*, ddsi_keyhash* hash, bool) { std::memset(hash, 0, sizeof *hash); };
  // Nothing reads in this process, so nothing is made of what comes in.
  ops.from_ser = [](const ddsi_sertype*, ddsi_serdata_kind, const nn_rdata*, std::size_t) -> ddsi_serdata* {
    return nullptr;
  };
  ops.from_ser_iov = [](const ddsi_sertype*, ddsi_serdata_kind, ddsrt_msg_iovlen_t, const ddsrt_iovec_t*,
                        std::size_t) -> ddsi_serdata* { return nullptr; };
  ops.from_keyhash = [](const ddsi_sertype*, const ddsi_keyhash*) -> ddsi_serdata* { return nullptr; };
  ops.from_sample = [](const ddsi_sertype*, ddsi_serdata_kind, const void*) -> ddsi_serdata* { return nullptr; };
  ops.to_sample = [](const ddsi_serdata*, void*, void**, void*) { return false; };
  ops.untyped_to_sample = [](const ddsi_sertype*, const ddsi_serdata*, void*, void**, void*) { return false; };
  return ops;
}

ddsi_sertype_ops type_operations() {
  ddsi_sertype_ops ops = {};
  ops.version = ddsi_sertype_v0;
  ops.free = [](ddsi_sertype* type) {
    ddsi_sertype_fini(type);
    delete type;
  };
  // Cyclone has compared names and operations before it asks.
  ops.equal = [](const ddsi_sertype*, const ddsi_sertype*) { return true; };
  ops.hash = [](const ddsi_sertype*) { return std::uint32_t{0}; };
  return ops;
}

const ddsi_serdata_ops kSampleOperations = sample_operations();
const ddsi_sertype_ops kTypeOperations = type_operations();

[[noreturn]] void fail(const std::string& what, dds_return_t code) {
  throw Error("ROS 2: " + what + ": " + dds_strretcode(code) +
              "; see what CYCLONEDDS_URI sets and which networks there are (ip address)");
}

dds_qos_t* make_qos(const Qos& qos) {
  constexpr dds_duration_t kBlock = DDS_MSECS(100);
  dds_qos_t* all = dds_create_qos();
  dds_qset_reliability(all, qos.reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, kBlock);
  dds_qset_history(all, DDS_HISTORY_KEEP_LAST, qos.depth);
  dds_qset_durability(all, qos.latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  if (qos.latched) {
    dds_qset_durability_service(all, 0, DDS_HISTORY_KEEP_LAST, qos.depth, DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED,
                                DDS_LENGTH_UNLIMITED);
  }
  dds_qset_writer_data_lifecycle(all, false);
  const dds_data_representation_id_t xcdr1 = DDS_DATA_REPRESENTATION_XCDR1;
  dds_qset_data_representation(all, 1, &xcdr1);
  return all;
}

}  // namespace

Participant::Participant(int domain)
    : handle_(dds_create_participant(static_cast<dds_domainid_t>(domain), nullptr, nullptr)) {
  if (handle_ < 0) fail("domain " + std::to_string(domain) + " cannot be joined", handle_);
}
Participant::~Participant() { dds_delete(handle_); }

TopicWriter::TopicWriter(const Participant& participant, const std::string& topic, std::string_view type,
                         const Qos& qos)
    : type_(new ddsi_sertype()) {
  const std::string name = dds_name_of(type);
  ddsi_sertype_init_flags(type_, name.c_str(), &kTypeOperations, &kSampleOperations,
                          DDSI_SERTYPE_FLAG_TOPICKIND_NO_KEY);
  dds_qos_t* const all = make_qos(qos);
  // "rt/": what ROS puts before the names of topics, and of nothing else.
  topic_ = dds_create_topic_sertype(participant.handle(), ("rt/" + topic).c_str(), &type_, all, nullptr, nullptr);
  // Cyclone may have put a type it knew already in its place; either belongs to the topic now.
  if (topic_ >= 0) writer_ = dds_create_writer(participant.handle(), topic_, all, nullptr);
  dds_delete_qos(all);
  if (topic_ < 0) ddsi_sertype_unref(type_);
  if (topic_ < 0 || writer_ < 0) fail("topic " + topic + " cannot be written", topic_ < 0 ? topic_ : writer_);
}

TopicWriter::~TopicWriter() {
  dds_delete(writer_);
  dds_delete(topic_);
}

bool TopicWriter::send(const CdrWriter& message) {
  const std::vector<u8>& bytes = message.bytes();
  // Cyclone takes the sample over, whatever comes of it.
  return dds_writecdr(writer_, new_sample(type_, SDK_DATA, bytes.data(), bytes.size())) == DDS_RETCODE_OK;
}

int TopicWriter::readers() const {
  dds_publication_matched_status_t status = {};
  dds_get_publication_matched_status(writer_, &status);
  return static_cast<int>(status.current_count);
}

std::string TopicWriter::refused() const {
  dds_offered_incompatible_qos_status_t status = {};
  dds_get_offered_incompatible_qos_status(writer_, &status);
  if (status.total_count == 0) return "";
  switch (status.last_policy_id) {
    case DDS_RELIABILITY_QOS_POLICY_ID:
      return "reliability";
    case DDS_DURABILITY_QOS_POLICY_ID:
      return "durability";
    default:
      return "a policy numbered " + std::to_string(status.last_policy_id);
  }
}

bool TopicWriter::wait_for_readers(std::int64_t most_ns) const {
  return dds_wait_for_acks(writer_, most_ns) == DDS_RETCODE_OK;
}

}  // namespace berth::ros2
