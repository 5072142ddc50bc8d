#pragma once

#include <arv.h>

#include <cstdint>
#include <string>

/// Chunk data for Aravis' fake camera, which has none: a row more than the image, at whose end the chunks stand while
/// the camera is set to send them, and the leader of its frames changed on its way to say so.
namespace berth::test {

/// The camera's description with the nodes for that.
std::string with_chunk_nodes(std::string description);
/// The camera's clock ticks with 125 MHz, as many cameras' do.
void set_tick_frequency(ArvFakeCamera* camera);
/// Writes the chunks into the row behind the image, where the camera is set to send them and `sends`: frames may come
/// without. The time is 3 ms before the one in the frame's leader.
void write_chunks(ArvFakeCamera* camera, ArvBuffer* buffer, bool sends);

}  // namespace berth::test
