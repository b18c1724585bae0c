"""`close_loop --manifest`: many sessions at once, on this machine or a cluster, with one page over all of them."""
