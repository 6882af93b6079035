def fields(request, scene, progress):
    return {}
