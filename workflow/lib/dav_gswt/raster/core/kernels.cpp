// This instruction set's table.
#include "kernels.h"

#define TEXT_OF(x) #x
#define TEXT(x) TEXT_OF(x)

namespace raster {
namespace ISA {

extern const Kernels table;
const Kernels table = {TEXT(ISA),        project,    load_colours,          blend_forward, blend_backward, collect,
                       project_backward, contribute, collect_contributions, loss,          adam};

}  // namespace ISA
}  // namespace raster
