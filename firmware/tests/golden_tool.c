/* golden_tool > golden_frames.json: after a wanted change of the frame, and never to make a test pass. */
#include "golden.h"

int main(void)
{
    golden_write(stdout);
    return 0;
}
