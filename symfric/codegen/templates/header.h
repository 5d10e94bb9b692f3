@sheet
#ifndef @guard
#define @guard

#ifdef __cplusplus
extern "C" {
#endif

@structs@status@prototypes
#ifdef __cplusplus
}
#endif

#endif /* @guard */
