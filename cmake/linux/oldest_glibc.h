/* The hypot of glibc 2.35 differs from the older one in how it reports overflow, which nobody asks it here: without it,
   glibc 2.34 is new enough. */
__asm__(".symver hypot,hypot@GLIBC_2.2.5");
